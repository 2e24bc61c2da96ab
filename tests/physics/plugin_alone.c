/* SPDX-License-Identifier: MIT */
/* plugin_alone - one plugin without a scene */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "plugin_alone.h"
#include <dlfcn.h>
#include <level.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static quern_status complain(quern_err *err, quern_status status, const char *param, const char *fmt, ...) {
	va_list args;
	(void)err;
	printf("  %s: ", param ? param : "-");
	va_start(args, fmt);
	vprintf(fmt, args);
	va_end(args);
	printf("\n");
	return status;
}

static const quern_host host = { .abi = QUERN_ABI, .fail = complain };

enum { SKIPPED = 77 };

/* Without a word the level that every processor has. */
static int wanted_level(void) {
	const char *level = getenv("QUERN_PLUGINS_LEVEL");
	if (!level || !*level || !strcmp(level, "v1")) return 1;
	if (!strcmp(level, "v3") || !strcmp(level, "v4")) return level[1] - '0';
	fail_msg("QUERN_PLUGINS_LEVEL is v1, v3 or v4, not %s", level);
	return 0;
}

const quern_plugin *alone_load(const char *id) {
	const char *folder = getenv("QUERN_PLUGINS_DIR");
	const int level = wanted_level();
	char path[4096], suffix[16] = "";
	if (level > quern_level_here()) {
		printf("this processor has not all of x86-64-v%d\n", level);
		exit(SKIPPED);
	}
	if (level > 1) snprintf(suffix, sizeof suffix, ".v%d", level);
	snprintf(path, sizeof path, "%s/%s%s.so", folder ? folder : "plugins", id, suffix);
	void *object = dlopen(path, RTLD_NOW | RTLD_LOCAL);
	if (!object) fail_msg("%s", dlerror());
	const quern_library *library = dlsym(object, "quern_library_2");
	assert_non_null(library);
	assert_int_equal(library->abi >> 16, QUERN_ABI_MAJOR);
	assert_string_equal(library->plugin->id, id);
	return library->plugin;
}

alone alone_make(const char *id, uint32_t dim, const alone_value *values) {
	alone out = { .plugin = alone_load(id) };
	out.self = calloc(1, out.plugin->instance_size + sizeof *out.self);
	assert_non_null(out.self);
	for (const quern_param *row = out.plugin->params; row->name; row++) {
		const bool planar = dim == 2 && row->flags & QUERN_PLANAR;
		quern_real x = row->flags & QUERN_MAYBE ? NAN : planar ? row->planar : row->def;
		bool found = !(row->flags & QUERN_REQUIRED);
		for (const alone_value *v = values; v->name; v++)
			if (!strcmp(v->name, row->name)) x = v->x, found = true;
		if (!found) fail_msg("%s needs %s", id, row->name);
		char *at = (char *)out.self + row->offset;
		switch (row->type) {
		case QUERN_T_INT: *(int32_t *)(void *)at = (int32_t)x; break;
		case QUERN_T_BOOL: *(bool *)(void *)at = x != 0; break;
		default: assert_int_equal(row->type, QUERN_T_REAL); *(quern_real *)(void *)at = x;
		}
	}
	const quern_setup setup = { .dim = dim, .lanes = QUERN_LANES, .host = &host };
	if (out.plugin->init) out.status = out.plugin->init(out.self, &setup, NULL);
	return out;
}

double alone_param(const alone *a, const char *name) {
	for (const quern_param *row = a->plugin->params; row->name; row++)
		if (!strcmp(row->name, name)) return a->self[row->offset / sizeof(quern_real)];
	fail_msg("no parameter %s", name);
	return 0;
}
