/* SPDX-License-Identifier: MIT */
/* plugin_alone - one plugin without a scene: its defaults, and what the test gives. Comes from the folder
 * QUERN_PLUGINS_DIR, of the instruction set QUERN_PLUGINS_LEVEL: v1, v3 or v4. Where the processor has not all of it the test
 * is skipped. */
#pragma once
#include <quern/abi.h>

typedef struct alone_value {
	const char *name;
	double x;
} alone_value;

typedef struct alone {
	const quern_plugin *plugin;
	quern_real *self;    /* free() it */
	quern_status status; /* init's */
} alone;

const quern_plugin *alone_load(const char *id);
/* `values` ends with a NULL name; every parameter must be a number, as far as there are any. */
alone alone_make(const char *id, uint32_t dim, const alone_value *values);
double alone_param(const alone *, const char *name);
