/* SPDX-License-Identifier: MIT */
/* drive_material - an instance of a material without a run, from the command line or from a scene */
#include "drive.h"
#include "quantity.h"
#include "random.h"
#include "run.h"
#include <stdlib.h>
#include <string.h>

static const char section_name[] = "continuum", slot_name[] = "material";

static void no_publish(const quern_setup *setup, const char *name, const char *unit, quern_real value) {
	(void)setup, (void)name, (void)unit, (void)value;
}
static bool no_section(const quern_setup *setup, const char *section) {
	(void)setup, (void)section;
	return false;
}
static const void *no_extension(const char *id) { return (void)id, NULL; }

static const quern_host host = { .abi = QUERN_ABI,
	.fail = quern_scene_fail,
	.random = quern_random,
	.publish = no_publish,
	.keeps = no_section,
	.extension = no_extension };

static bool print_faults(const quern_report *report) {
	if (!quern_report_errors(report)) return false;
	quern_report_print(report, stderr);
	return true;
}

static const quern_plugin_file *find(drive_material *m, const char *name) {
	const quern_mark nowhere = { 0 };
	const char *kind = quern_material_kind.name;
	if (strchr(name, '/')) return quern_loader_open(m->loader, name, m->report, nowhere);
	if (quern_id_is_of(name, kind)) name = quern_id_name(name);
	return quern_loader_find(m->loader, kind, name, m->report, nowhere);
}

/* Its table as this program knows the kind, and whether it can be used here at all. */
static bool look_at(
	drive_material *m, quern_loader *loader, quern_report *report, const quern_plugin_file *file) {
	const quern_mark nowhere = { 0 };
	m->file = file;
	if (!file) return false;
	if (!quern_id_is_of(file->plugin.id, quern_material_kind.name))
		quern_report_add(report, nowhere, "%s is no material; see quern list", file->plugin.id);
	else if (!(file->plugin.dims & (m->dim == 2 ? QUERN_2D : QUERN_3D)))
		quern_report_add(report, nowhere, "%s has no form for %u-D", file->plugin.id, m->dim);
	else m->ops = quern_loader_ops(loader, file, &quern_material_kind, report, nowhere);
	return m->ops && !quern_report_errors(report);
}

static bool make(drive_material *m, const quern_texts *sets) {
	for (size_t i = 0; i < sets->n; i++) quern_tree_set(m->tree, sets->at[i], m->report);
	const quern_reading reading = { m->report, m->units, m->dim, NULL, 0, m->tree };
	m->self = aligned_alloc(64, (m->file->plugin.instance_size + 127u) & ~(size_t)63);
	if (!m->self) abort();
	memset(m->self, 0, m->file->plugin.instance_size);
	quern_params_read(
		&reading, m->file->plugin.id, m->file->params, m->tree->root, (quern_mark) { 0 }, NULL, m->self);
	if (quern_report_errors(m->report)) return false;
	quern_setup setup = { .dim = m->dim, .lanes = QUERN_LANES, .host = &host };
	for (uint32_t k = 0; k < m->dim; k++) setup.upper[k] = 1;
	setup.gravity[m->dim - 1] = -9.81;
	quern_err err = { m->report, m->tree->root, { 0 }, m->file->plugin.id };
	m->ready = !m->file->plugin.init || m->file->plugin.init(m->self, &setup, &err) == QUERN_OK;
	return m->ready && !quern_report_errors(m->report);
}

static void ask_moduli(drive_material *m) {
	m->ops->moduli(m->self, m->dim, &m->bulk, &m->shear, &m->density);
}

bool quern_drive_material_open(drive_material *m, const char *name, uint32_t dim, const quern_texts *sets) {
	*m = (drive_material) { .dim = dim };
	m->report = quern_report_create();
	m->units = quern_units_create();
	m->loader = quern_loader_create();
	m->tree = quern_tree_parse("--set", "{}", 2, m->report);
	quern_loader_beware(m->loader);
	const bool good = look_at(m, m->loader, m->report, find(m, name)) && make(m, sets);
	print_faults(m->report);
	if (good) ask_moduli(m);
	return good;
}

/* The one plugin in the slot of the scene's section. */
static const quern_instance *instance_of(const quern_scene *scene) {
	const quern_section *section = quern_scene_section(scene, section_name);
	for (size_t k = 0; section && k < section->n_slots; k++)
		if (!strcmp(section->slots[k].slot->name, slot_name) && section->slots[k].n)
			return section->slots[k].filling[0].instance;
	return NULL;
}

bool quern_drive_material_of(drive_material *m, const char *path, const quern_texts *sets) {
	*m = (drive_material) { .units = quern_units_create() };
	m->scene = quern_scene_read(path, sets->at, &quern_host_table);
	if (print_faults(m->scene->report)) return false;
	const quern_instance *instance = instance_of(m->scene);
	m->dim = (uint32_t)m->scene->general.dimension;
	if (!instance) {
		fprintf(stderr, "quern drive: error: %s has no %s.%s\n", path, section_name, slot_name);
		return false;
	}
	m->self = instance->self;
	if (!look_at(m, m->scene->loader, m->scene->report, instance->file))
		return print_faults(m->scene->report), false;
	ask_moduli(m);
	return true;
}

void quern_drive_material_finish(drive_material *m) {
	quern_units_destroy(m->units);
	if (m->scene) {
		quern_scene_destroy(m->scene);
		return;
	}
	if (m->ready && m->file->plugin.finish) m->file->plugin.finish(m->self);
	if (m->self) quern_params_finish(m->file->params, m->self);
	free(m->self);
	quern_tree_destroy(m->tree);
	quern_loader_destroy(m->loader);
	quern_report_destroy(m->report);
}
