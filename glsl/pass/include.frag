// Functions for another program to include, without main(). The program's declarations and main() follow; it calls light_arriving,
// light_shines_on and light_visibility.
#include <light>
#include <shadow>
