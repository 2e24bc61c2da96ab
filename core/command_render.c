#include "command.h"
int quern_command_render(int argc, char **argv) {
	(void)argc, (void)argv;
	return QUERN_EXIT_USAGE;
}
