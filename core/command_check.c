#include "command.h"
int quern_command_check(int argc, char **argv) {
	(void)argc, (void)argv;
	return QUERN_EXIT_USAGE;
}
