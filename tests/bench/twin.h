/* SPDX-License-Identifier: MIT */
/* twin - a plugin's source once more, in a program instead of a library, and two ways to call it. Its batch is that of its kind. */
#pragma once
#include <quern/abi.h>

typedef struct twin {
	const quern_library *linked;
	/* Through the table of a plugin of this kind, `calls` times. */
	void (*call)(const quern_plugin *, uint32_t dim, const void *self, const void *batch, uint32_t calls);
	/* By code that the compiler has put into the loop: [0] 2-D, [1] 3-D. */
	void (*inlined[2])(const void *self, const void *batch, uint32_t calls);
} twin;
