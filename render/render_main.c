/* SPDX-License-Identifier: MIT */
/* quern-render - `quern render`: pictures of frames, a program of its own since it alone needs Cairo */
#include "h5.h"
#include "render.h"

int main(int argc, char **argv) {
	quern_h5_begin();
	return quern_ended(quern_command_render.run(argc, argv));
}
