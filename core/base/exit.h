/* SPDX-License-Identifier: MIT */
/* exit - the statuses that programs end with */
#pragma once

enum {
	QUERN_EXIT_DONE,
	QUERN_EXIT_USAGE,  /* the command line cannot be read */
	QUERN_EXIT_SCENE,  /* a scene, plugin or file cannot be used, found before the first step */
	QUERN_EXIT_FAILED, /* the run failed */
	QUERN_EXIT_IO,     /* files could not be written */
	QUERN_EXIT_INTERRUPTED = 130
};
