/* SPDX-License-Identifier: MIT */
/* solver.bodies - walls and bodies: who is there, how they move, and what each has given to the material.
 * docs/theory/bodies.md, section 3 */
#include "../common/name.h"
#include "bodies.h"
#include <string.h>

typedef struct {
	bool moving; /* some bodies do */
} bodies;

static const quern_param params[] = { QUERN_PARAM(bodies, moving, NULL,
										  "Write out where bodies are; set by itself where one moves.",
										  .flags = QUERN_ADVANCED),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static const char *const whens[] = { "always", "settling", "running", "never", NULL };
static const char *const boundaries[] = { "slip", "sticky", "none", NULL };
static const quern_param table_rows[] = { QUERN_PARAM(
											  body_place, time, "s", "When.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(body_place, shift, "m", "How far it has come by then."),
	QUERN_PARAM(body_place, angle, "rad", "How far it has turned by then."), QUERN_END_PARAMS };
static const quern_param rows[] = {
	QUERN_PARAM_AS(body_item, when, "while", "1",
		"When it is there: a gate while settling, or until a stage of the scene says never.",
		.choices = whens),
	QUERN_PARAM(body_item, boundary, "1", "What it does to the continuum's grid.", .choices = boundaries),
	QUERN_PARAM_AS(body_item, friction, "boundary.frictional", "1",
		"Coulomb friction on the continuum's grid, in place of slip or sticky.", .flags = QUERN_MAYBE,
		.min = 0, .max = 100),
	QUERN_PARAM_AS(body_item, slip, "boundary.rough", "1",
		"Slip length in grain diameters, in place of slip or sticky: friction that grows with the speed as the "
		"material's own does with its rate, so that the speed along the body is that over so many diameters inside.",
		.flags = QUERN_MAYBE, .unless = "boundary.frictional", .min = 0, .max = 1e6),
	QUERN_PARAM_AS(body_item, slow, "boundary.static_friction", "1",
		"Beside rough: mu_s of slow sliding; left out, all three are the material's own.",
		.flags = QUERN_MAYBE, .unless = "boundary.frictional", .min = 0, .max = 10),
	QUERN_PARAM_AS(body_item, fast, "boundary.limit_friction", "1", "Beside rough: mu_2 of fast sliding.",
		.flags = QUERN_MAYBE, .unless = "boundary.frictional", .min = 0, .max = 10),
	QUERN_PARAM_AS(body_item, number, "boundary.inertial_number", "1",
		"Beside rough: I_0 of sliding, at which friction is half-way between the two.", .flags = QUERN_MAYBE,
		.unless = "boundary.frictional", .min = 0, .max = 100),
	QUERN_PARAM(body_item, displacement, "m",
		"How far before the body the continuum ends, since grains lie looser there: what they lack of its "
		"density, added up from the body on, over that density. Less than a cell.",
		.max = INFINITY),
	QUERN_PARAM(body_item, name, NULL, "A word that messages call it by, and observers may: its own.",
		.flags = QUERN_MAYBE),
	QUERN_PARAM(body_item, material, NULL,
		"What it is made of: one of the grains' materials, or a word of its own that stands in grains.pairs.",
		.flags = QUERN_MAYBE),
	QUERN_PARAM_AS(body_item, motion.velocity, "motion.velocity", "m/s", "At which it moves on."),
	QUERN_PARAM_AS(
		body_item, motion.spin, "motion.spin", "rad/s", "At which it turns on.", .min = -1e6, .max = 1e6),
	QUERN_PARAM_AS(body_item, motion.amplitude, "motion.sinus.amplitude", "m", "Of a motion to and fro."),
	QUERN_PARAM_AS(body_item, motion.swing, "motion.sinus.swing", "rad", "Amplitude of a turning to and fro.",
		.min = -1e6, .max = 1e6),
	QUERN_PARAM_AS(body_item, motion.frequency, "motion.sinus.frequency", "1/s",
		"How often it comes and goes.", .max = 1e9),
	QUERN_PARAM_AS(body_item, motion.phase, "motion.sinus.phase", "rad",
		"Where in its course it begins: 0 in the middle at full speed, 1.5708 at a point of return.",
		.min = -1e6, .max = 1e6),
	QUERN_PARAM_AS(body_item, motion.table, "motion.table", NULL,
		"Places at times, of which each is reached straight from the one before.", .rows = table_rows,
		.item_size = sizeof(body_place)),
	QUERN_PARAM_AS(body_item, motion.axis, "motion.axis", "1",
		"Direction that it turns about in 3-D, by the right hand; left out, along z.", .flags = QUERN_MAYBE),
	QUERN_PARAM_AS(body_item, motion.about, "motion.about", "m",
		"A place that it turns about, as it stands at first; left out, its middle.", .flags = QUERN_MAYBE),
	QUERN_PARAM_AS(body_item, motion.from, "motion.from", "s",
		"When velocity, spin and sinus set in; until then it stands where it is.", .max = INFINITY),
	QUERN_PARAM_AS(body_item, motion.until, "motion.until", "s", "When they end; then it stays where it is.",
		.def = INFINITY, .max = INFINITY),
	QUERN_END_PARAMS
};

static const quern_set sets[] = {
	{ .name = "body", .plural = "bodies", .doc = "Walls and bodies, in the order of the scene." },
	{ .name = NULL }
};
static const quern_slot slots[] = { { .name = "",
										.kind = &quern_body_kind,
										.doc = "Bodies. A stage cannot change their shape or place: they "
											   "move by motion, and come and go by while.",
										.list = 1,
										.once = 1,
										.stage = { "bodies.place" },
										.override = "grains.contact",
										.rows = rows,
										.item_size = sizeof(body_item) },
	{ .name = NULL } };

/* clang-format off */
#define PLACE_USES(X) \
	X(PLACE_IMPULSE, "body.impulse", "N s", QUERN_WRITE, QUERN_VECTOR, .flags = QUERN_OPTIONAL, \
		.doc = "Given to the material since the release.") \
	X(PLACE_TWIST, "body.twist", "N m s", QUERN_WRITE, QUERN_AXIAL, .flags = QUERN_OPTIONAL, \
		.doc = "Its moment about what the body turns about.") \
	X(PLACE_WORK, "body.work", "J", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, \
		.doc = "Done on the material since the release.")
#define SHOW_USES(X) \
	X(SHOW_POSITION, "body.position", "m", QUERN_WRITE, QUERN_VECTOR, .when = "moving", .flags = QUERN_SHOWN, \
		.doc = "Where the origin of the body's own frame is.") \
	X(SHOW_TURN, "body.turn", "1", QUERN_WRITE, QUERN_TENSOR, .when = "moving", .initial = 1, .flags = QUERN_SHOWN, \
		.doc = "From the body's own frame to the scene's.") \
	X(SHOW_VELOCITY, "body.velocity", "m/s", QUERN_WRITE, QUERN_VECTOR, .flags = QUERN_OPTIONAL, \
		.doc = "Of the origin of the body's own frame.") \
	X(SHOW_SPIN, "body.spin", "rad/s", QUERN_WRITE, QUERN_AXIAL, .flags = QUERN_OPTIONAL, \
		.doc = "Angular velocity.")
/* clang-format on */
QUERN_USE_ENUM(SHOW_USES);
static const quern_use place_uses[] = QUERN_USE_ROWS(PLACE_USES);
/* clang-format off */
#define LAST_USES(X, access) \
	X(LAST_POSITION, "body.last_position", "m", access, QUERN_VECTOR, .when = "moving", \
		.doc = "Its position when the last step had ended.") \
	X(LAST_TURN, "body.last_turn", "1", access, QUERN_TENSOR, .when = "moving", .initial = 1, \
		.doc = "Its turn then.")
#define FOLLOW_USES(X) LAST_USES(X, QUERN_WRITE)
#define JOIN_USES(X) LAST_USES(X, QUERN_READ)
/* clang-format on */
QUERN_USE_ENUM(JOIN_USES);
static const quern_use follow_uses[] = QUERN_USE_ROWS(FOLLOW_USES);
static const quern_use show_uses[] = QUERN_USE_ROWS(SHOW_USES);
static const quern_use join_uses[] = QUERN_USE_ROWS(JOIN_USES);

static const char *name_of(const quern_bound *body) { return ((const body_item *)body->item)->name; }

/* Names are words of their own, published as the number of the body. */
static quern_status name_body(const quern_setup *setup, const quern_bound *body, uint32_t i, quern_err *err) {
	const char *name = name_of(&body[i]), *dot = strchr(body[i].id, '.');
	char where[120], published[60];
	snprintf(where, sizeof where, "%u.%.60s.name", i, dot ? dot + 1 : body[i].id);
	if (!name) return QUERN_OK;
	if (!quern_name_is_good(name))
		return setup->host->fail(err, QUERN_E_PARAM, where,
			"'%.60s' is no name: it must be letters, digits and '_', beginning with a letter, at most %d of "
			"them",
			name, LONGEST_NAME);
	for (uint32_t k = 0; k < i; k++)
		if (name_of(&body[k]) && !strcmp(name_of(&body[k]), name))
			return setup->host->fail(
				err, QUERN_E_PARAM, where, "body %u is called '%s' already: give each its own name", k, name);
	snprintf(published, sizeof published, "body.%s", name);
	setup->host->publish(setup, published, "1", i);
	return QUERN_OK;
}

typedef struct {
	const quern_setup *setup;
	const quern_bound *body;
	uint32_t i;
	quern_err *err;
} naming;

static quern_status refuse_key(const naming *n, const char *group, const char *key, const char *why) {
	const char *dot = strchr(n->body->id, '.');
	char where[140];
	snprintf(where, sizeof where, "%u.%.60s.%s.%s", n->i, dot ? dot + 1 : n->body->id, group, key);
	return n->setup->host->fail(n->err, QUERN_E_PARAM, where, "%s", why);
}

/* A rough boundary's own friction is a law of three numbers. */
static quern_status check_friction(const naming *n, const body_item *item) {
	static const char *const keys[] = { "static_friction", "limit_friction", "inertial_number" };
	const quern_real value[] = { item->slow, item->fast, item->number };
	const char *given = NULL, *missing = NULL;
	for (int k = 0; k < 3; k++)
		if (isnan(value[k])) missing = keys[k];
		else given = given ? given : keys[k];
	if (!given) return QUERN_OK;
	if (isnan(item->slip)) return refuse_key(n, "boundary", given, "is of a rough boundary: give rough too");
	if (missing)
		return refuse_key(n, "boundary", missing,
			"is needed beside the others of static_friction, limit_friction and inertial_number");
	if (item->fast < item->slow)
		return refuse_key(n, "boundary", "limit_friction",
			"is below static_friction; friction must not fall with the speed");
	return QUERN_OK;
}

/* ---- motion ---- */

static quern_status refuse(const naming *n, const char *key, const char *why) {
	return refuse_key(n, "motion", key, why);
}

static bool turns(const body_motion *m) {
	const body_place *row = m->table.items;
	for (uint32_t i = 0; i < m->table.n; i++)
		if (row[i].angle != 0) return true;
	return m->spin != 0 || m->swing != 0;
}

static quern_status check_pivot(const naming *n, const body_motion *m) {
	const quern_real square = m->axis[0] * m->axis[0] + m->axis[1] * m->axis[1] + m->axis[2] * m->axis[2];
	body_pivot pivot;
	if (!isnan(square) && n->setup->dim == 2) return refuse(n, "axis", "has no meaning in 2-D: leave it out");
	if (!isnan(square) && !(square > 0 && isfinite(square))) return refuse(n, "axis", "has no length");
	if (quern_motion_pivot(m, n->body, n->setup->dim, &pivot) || !turns(m)) return QUERN_OK;
	return refuse(n, "about", "is needed: the body has no middle that it could turn about");
}

static quern_status check_motion(const naming *n, const body_motion *m) {
	const body_place *row = m->table.items;
	const bool sways = m->swing != 0 || m->amplitude[0] != 0 || m->amplitude[1] != 0 || m->amplitude[2] != 0;
	if (!(m->until > m->from)) return refuse(n, "until", "must be later than motion.from");
	if (sways && !(m->frequency > 0)) return refuse(n, "sinus.frequency", "is needed, above 0");
	if (!sways && m->frequency > 0)
		return refuse(n, "sinus.frequency", "comes to nothing: give sinus an amplitude or a swing");
	for (uint32_t i = 1; i < m->table.n; i++)
		if (!(row[i].time > row[i - 1].time))
			return refuse(n, "table", "its times must grow from row to row");
	return check_pivot(n, m);
}

static quern_status ready(void *self, const quern_setup *setup, const quern_bound *const *slot,
	const uint32_t *n_slot, quern_err *err) {
	bodies *p = self;
	setup->host->publish(setup, "bodies.count", "1", n_slot[0]);
	quern_status status = QUERN_OK;
	for (uint32_t i = 0; i < n_slot[0]; i++) {
		const naming n = { setup, &slot[0][i], i, err };
		if (name_body(setup, slot[0], i, err) != QUERN_OK) status = QUERN_E_PARAM;
		const body_item *item = slot[0][i].item;
		if (check_motion(&n, &item->motion) != QUERN_OK) status = QUERN_E_PARAM;
		if (check_friction(&n, item) != QUERN_OK) status = QUERN_E_PARAM;
	}
	p->moving = quern_bodies_move(slot[0], n_slot[0]);
	return status;
}

static quern_status place(const void *self, const quern_step *s) {
	const uint32_t n = s->n_slot[0];
	int32_t *from = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	(void)self;
	if (!from) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < n; i++) from[i] = -1;
	return s->host->remap(s->run, "body", n, from, 0, NULL);
}

static void put_poses(
	const quern_step *s, const body_pose *pose, const quern_column *position, const quern_column *turn) {
	for (uint32_t b = 0; b < s->n_slot[0]; b++)
		for (uint32_t k = 0; k < s->dim; k++) {
			if (position->real[0]) position->real[k][b] = pose[b].pose.position[k];
			for (uint32_t l = 0; l < s->dim && turn->real[0]; l++)
				turn->real[s->dim * k + l][b] = pose[b].pose.turn[3 * k + l];
		}
}

/* For whoever looks: solvers ask for the poses of their own time. */
static quern_status show(const void *self, const quern_step *s) {
	const quern_column *u = s->use;
	const uint32_t dim = s->dim, n_turn = dim == 3 ? 3 : 1;
	const body_pose *pose = quern_body_poses(s, 0, s->time, s->time);
	(void)self;
	if (!pose) return QUERN_E_MEMORY;
	put_poses(s, pose, &u[SHOW_POSITION], &u[SHOW_TURN]);
	for (uint32_t b = 0; b < s->n_slot[0]; b++) {
		for (uint32_t k = 0; k < dim && u[SHOW_VELOCITY].real[0]; k++)
			u[SHOW_VELOCITY].real[k][b] = pose[b].pose.velocity[k];
		for (uint32_t k = 0; k < n_turn && u[SHOW_SPIN].real[0]; k++)
			u[SHOW_SPIN].real[k][b] = pose[b].pose.spin[dim == 3 ? k : 2];
	}
	return QUERN_OK;
}

/* Where bodies have come to at the end of a step: the next one may begin a stage of the scene, with another course. */
static quern_status follow(const void *self, const quern_step *s) {
	if (!((const bodies *)self)->moving) return QUERN_OK;
	const body_pose *pose = quern_body_poses(s, 0, s->time + s->dt, s->time + s->dt);
	if (!pose) return QUERN_E_MEMORY;
	put_poses(s, pose, &s->use[LAST_POSITION], &s->use[LAST_TURN]);
	return QUERN_OK;
}

/* A course is reckoned from its own keys alone: at a stage of the scene it must lead on from where the last one ended. */
static quern_status lead_on(const void *self, const quern_step *s) {
	const quern_column at = s->use[LAST_POSITION], turn = s->use[LAST_TURN];
	const uint32_t dim = s->dim;
	if (!((const bodies *)self)->moving || s->step != s->stage_step || !s->step) return QUERN_OK;
	const body_pose *pose = quern_body_poses_now(s, 0);
	if (!pose) return QUERN_E_MEMORY;
	for (uint32_t b = 0; b < s->n_slot[0]; b++) {
		quern_real jump = 0, size = 0;
		for (uint32_t k = 0; k < dim; k++) {
			size += (s->upper[k] - s->lower[k]) * (s->upper[k] - s->lower[k]);
			jump = fmax(jump, fabs(pose[b].pose.position[k] - at.real[k][b]));
			for (uint32_t l = 0; l < dim; l++)
				jump =
					fmax(jump, sqrt(size) * fabs(pose[b].pose.turn[3 * k + l] - turn.real[dim * k + l][b]));
		}
		char which[BODY_WORDS];
		if (!(jump > 1e-9 * sqrt(size))) continue;
		return s->host->stop(s->run, QUERN_E_NUMERIC, NULL, -1,
			"%s would jump by %.3g m where this stage of the scene begins: a stage's motion is reckoned from "
			"t = 0 "
			"on, by its own keys alone; let it lead on from there by from, until and table",
			quern_body_say(&s->slot[0][b], b, which), jump);
	}
	return QUERN_OK;
}

static const quern_stage stages[] = { { .name = "bodies.place",
										  .doc = "One entry per body.",
										  .phase = QUERN_SETUP,
										  .uses = place_uses,
										  .run = place },
	{ .name = "bodies.lead_on",
		.doc = "No body jumps where a stage of the scene begins.",
		.phase = QUERN_BEGIN,
		.uses = join_uses,
		.run = lead_on },
	{ .name = "bodies.follow",
		.doc = "Where bodies have come to.",
		.phase = QUERN_END,
		.uses = follow_uses,
		.run = follow },
	{ .name = "bodies.show",
		.doc = "Where bodies are.",
		.phase = QUERN_OUTPUT,
		.uses = show_uses,
		.run = show },
	{ .name = NULL } };

static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .section = "bodies", .sets = sets, .slots = slots,
	.stages = stages, .ready = ready };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "solver.bodies",
	.brief = "Walls and bodies.",
	.doc = "Owns the set of bodies; grains and continuum look at the same ones.",
	.instance_size = sizeof(bodies),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
