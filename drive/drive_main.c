/* SPDX-License-Identifier: MIT */
/* quern-drive - `quern drive`: one point of a material along a path, a program of its own since it alone knows materials */
#include "drive.h"
#include "h5.h"

int main(int argc, char **argv) {
	quern_h5_begin();
	return quern_ended(quern_command_drive.run(argc, argv));
}
