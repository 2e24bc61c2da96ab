/* plugin_alone - one plugin without a scene */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "plugin_alone.h"
#include <dlfcn.h>
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

const quern_plugin *alone_load(const char *id) {
	const char *folder = getenv("QUERN_PLUGINS_DIR"), *level = getenv("QUERN_PLUGINS_LEVEL");
	char path[4096];
	snprintf(path, sizeof path, "%s/%s%s.so", folder ? folder : "plugins", id, level ? level : "");
	void *object = dlopen(path, RTLD_NOW | RTLD_LOCAL);
	if (!object) fail_msg("%s", dlerror());
	const quern_library *library = dlsym(object, "quern_library_1");
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
		assert_int_equal(row->type, QUERN_T_REAL);
		out.self[row->offset / sizeof *out.self] = x;
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
