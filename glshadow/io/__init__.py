"""Files and objects of other libraries become scenes."""
