#include "command.h"
int quern_command_new(int argc, char **argv) {
	(void)argc, (void)argv;
	return QUERN_EXIT_USAGE;
}
