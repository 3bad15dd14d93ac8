// No main: what a program of someone else includes. Its own declarations and main() follow, and call light_arriving, light_shines_on and light_visibility.
#include <light>
#include <shadow>
