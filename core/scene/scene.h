/* SPDX-License-Identifier: MIT */
/* scene - a scene file read, checked and resolved: every section's solver, every slot's plugins, every default */
#pragma once
#include "file.h"
#include "loader.h"
#include "param.h"

/* One plugin with its parameters filled in. */
typedef struct quern_instance {
	const quern_plugin_file *file;
	const void *ops;       /* as whoever calls it knows them */
	const quern_node *map; /* its parameters as the scene gives them, or NULL */
	quern_mark mark;
	char *path; /* SECTION.SLOT */
	void *self;
	bool ready; /* init has succeeded: finish is owed */
} quern_instance;

/* One entry of a slot: a plugin, the slot's own rows, and instances with another entry's overrides. */
typedef struct quern_filling {
	quern_instance *instance;
	const void *ops; /* as the solver of this slot knows them */
	void *item;
	quern_instance **variant; /* by entry of the overriding slot; NULL where nothing is overridden */
	size_t n_variant;
	quern_instance *
		*refined; /* by item of the list that refines the slot: 1 + n_variant each, none of them NULL */
	size_t n_refined;
} quern_filling;

typedef struct quern_slot_use {
	const quern_slot *slot;
	char *path;             /* SECTION.SLOT */
	quern_filling *filling; /* same_as: instances, items and variants are that slot's */
	size_t n, capacity;
	bool borrowed;
} quern_slot_use;

typedef struct quern_section {
	const char *name;
	quern_node *node;
	quern_mark mark;
	quern_instance *solver;
	const quern_solver_ops *ops;
	quern_slot_use *slots;
	size_t n_slots;
} quern_section;

/* What every observer takes besides its own keys. */
typedef struct quern_observe_item {
	const char *label; /* never NULL once the scene is read, and no other observer's */
} quern_observe_item;
extern const quern_slot quern_observe_slot;

/* What the core itself takes from a scene. */
typedef struct quern_general {
	int32_t version, dimension, seed, batch, instructions;
	const char *name, *model, *step_text;
	quern_real gravity[3], lower[3], upper[3];
	bool periodic[3];
	bool open[2][3];                         /* lower, upper; by axis */
	quern_real end, every, checkpoint, step; /* s; step 0: auto */
	bool force;
	bool compress;
	bool every_given; /* output.every stands in the scene */
} quern_general;

enum { QUERN_MOST_SECTIONS = 16 };

/* An entry of `stages`: from `begin` to where the next one begins. */
typedef struct quern_episode {
	quern_real begin;          /* s */
	struct quern_scene *scene; /* with the values that hold then; NULL: those of the scene itself */
} quern_episode;

typedef struct quern_scene {
	quern_general general;
	bool later; /* these are the values of a stage of another scene, whose loader this is */
	bool sound; /* dimension, gravity and domain may be relied on */
	quern_report *report;
	quern_units *units;
	quern_loader *loader;
	quern_tree *tree;
	quern_tree **defaults; /* slots filled by their `def` */
	size_t n_defaults, defaults_capacity;
	quern_section sections[QUERN_MOST_SECTIONS]; /* in the order in which they were read */
	size_t n_sections;
	const char *kept[QUERN_MOST_SECTIONS]; /* names of all that take part, once it is known */
	size_t n_kept;
	quern_slot_use observe;
	char **fields; /* output.fields */
	quern_mark *field_marks;
	size_t n_fields;
	quern_episode *episodes; /* in the order of time; none: the scene is one */
	size_t n_episodes;
	quern_published *published;
	size_t n_published, published_capacity;
	quern_instance **instances;
	size_t n_instances, instances_capacity;
	const quern_host *host;
} quern_scene;

/* Reads and resolves; faults are in scene->report. `sets` are the --set options, NULL-terminated. Never NULL. */
quern_scene *quern_scene_read(const char *path, const char *const *sets, const quern_host *);
quern_scene *quern_scene_parse(const char *name, const char *data, size_t length, const quern_host *);
/* The scene of a tree, which it takes over, for a stage of another one, which must outlive it and whose plugins it
 * has; `stages` in the tree count for nothing. */
quern_scene *quern_scene_vary(const quern_scene *, quern_tree *);
void quern_scene_destroy(quern_scene *);

/* The scene with every default written out, in SI: a tree to destroy, or YAML to free(). */
quern_node *quern_scene_tree(const quern_scene *, const quern_naming *);
char *quern_scene_resolved(const quern_scene *, const quern_naming *);
/* The rows of the core's own keys, for schema and describe. */
extern const quern_param quern_general_rows[];
/* "lower_x": face side of axis k. */
const char *quern_face_name(int side, int axis);
/* Keys of the core that take lists, which rows do not describe; NULL-name terminated. */
typedef struct quern_general_list {
	const char *name, *item, *doc;
} quern_general_list;
extern const quern_general_list quern_general_lists[];

const quern_section *quern_scene_section(const quern_scene *, const char *name);
/* What `refined` points to as a solver sees it: free() it. NULL if there is nothing. */
const void **quern_filling_refined(const quern_filling *);
/* Whether `model` keeps everything that stands there. */
bool quern_scene_is_whole(const quern_scene *);
/* What rows of this scene are read with. */
quern_reading quern_scene_reading(const quern_scene *);
/* The set-up record that every init gets. */
quern_setup quern_scene_setup(const quern_scene *, const char *path);

/* The services of the set-up phase; run/host.c puts them into the table. */
struct quern_err {
	quern_report *report;
	const quern_node *map;
	quern_mark mark;
	const char *owner;
};
quern_status quern_scene_fail(quern_err *, quern_status, const char *param, const char *fmt, ...)
	__attribute__((format(printf, 4, 5)));
void quern_scene_publish(const quern_setup *, const char *name, const char *unit, quern_real value);
bool quern_scene_keeps(const quern_setup *, const char *section);
