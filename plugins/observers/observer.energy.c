/* SPDX-License-Identifier: MIT */
/* observer.energy - energy by kind: what grains and points have, and what was lost. docs/theory/contacts.md, section
 * 8 */
#include "../common/books.h"
#include "../common/radius.h"
#include "observers.h"
#include <quern/observer.h>

typedef struct {
	int32_t unused;
} observer;
static const quern_param params[] = { QUERN_END_PARAMS };
/* clang-format off */
#define OWN_USES(X) \
	X(GRAIN_POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(GRAIN_VELOCITY, "grain.velocity", "m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(GRAIN_SPIN, "grain.spin", "rad/s", QUERN_READ, QUERN_AXIAL, .flags = QUERN_OPTIONAL) \
	X(GRAIN_RADIUS, "grain.radius", "m", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(POINT_POSITION, "point.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(POINT_VELOCITY, "point.velocity", "m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(POINT_ENERGY, "point.energy", "J/kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(STORED, "total.stored", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(SHEARED, "total.sheared", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(DAMPED, "total.damped", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(RUBBED, "total.rubbed", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(WORK, "body.work", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(STRAINED, "total.box_work", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(EXCHANGED, "total.exchanged", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(GRAINS_LEFT, "grain_face.energy", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(GRAINS_LEFT_HEIGHT, "grain_face.potential", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(POINTS_LEFT, "point_face.energy", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(POINTS_LEFT_HEIGHT, "point_face.potential", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(GRAINS_POURED, "grain_source.energy", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(GRAINS_POURED_HEIGHT, "grain_source.potential", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(POINTS_POURED, "point_source.energy", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED) \
	X(POINTS_POURED_HEIGHT, "point_source.potential", "J", QUERN_READ, QUERN_SCALAR, .flags = QUERN_WANTED)
/* clang-format on */
QUERN_USE_ENUM_FROM(CLOUD_USES_ROWS, OWN_USES);
static const quern_use uses[] = { CLOUD_USES(QUERN_USE_ROW) OWN_USES(QUERN_USE_ROW) QUERN_END_USES };

enum {
	KINETIC,
	SPINNING,
	POINTS,
	POTENTIAL,
	SPRINGS,
	TANGENTIAL,
	ELASTIC,
	DASHPOTS,
	SLIDING,
	COUPLING,
	BODIES,
	PASSED,
	SUM
};
static const quern_output outputs[] = { { .name = "grains", .unit = "J", .doc = "Kinetic, of grains." },
	{ .name = "spin", .unit = "J", .doc = "Kinetic, of their rotation." },
	{ .name = "points", .unit = "J", .doc = "Kinetic, of points." },
	{ .name = "potential", .unit = "J", .doc = "-m g x of both." },
	{ .name = "stored", .unit = "J", .doc = "In normal springs of contacts." },
	{ .name = "sheared", .unit = "J", .doc = "In tangential springs of contacts." },
	{ .name = "elastic", .unit = "J", .doc = "In points." },
	{ .name = "damped", .unit = "J", .doc = "Lost in dashpots so far." },
	{ .name = "rubbed",
		.unit = "J",
		.doc = "Lost to sliding contacts so far, and to those that yield or whose liquid forms a bridge." },
	{ .name = "exchanged", .unit = "J", .doc = "Taken by the coupling so far." },
	{ .name = "driven",
		.unit = "J",
		.doc = "Done by bodies that move and by a box that is strained so far, with a minus." },
	{ .name = "passed",
		.unit = "J",
		.doc = "Taken out through open faces, less what sources brought: of motion, of height and stored in "
			   "points." },
	{ .name = "budget", .unit = "J", .doc = "All of it: constant for grains alone." }, { .name = NULL } };

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	const quern_column *u = b->use;
	const uint32_t turns = b->dim == 3 ? 3 : 1;
	const quern_real *radius = u[GRAIN_RADIUS].real[0], turning = quern_radius_inertia(b->dim);
	cloud_sums grains, points;
	(void)self;
	if (!observe_clouds(b, host, run, &grains, &points)) return QUERN_E_MEMORY;
	CLOUD_ADD(&grains, i, 0.5 * cloud_square(&u[GRAIN_VELOCITY], i, b->dim), out[KINETIC]);
	if (u[GRAIN_SPIN].real[0])
		CLOUD_ADD(&grains, i, 0.5 * turning * radius[i] * radius[i] * cloud_square(&u[GRAIN_SPIN], i, turns),
			out[SPINNING]);
	CLOUD_ADD(&points, i, 0.5 * cloud_square(&u[POINT_VELOCITY], i, b->dim), out[POINTS]);
	CLOUD_ADD(&grains, i, cloud_height(&u[GRAIN_POSITION], i, b->dim, b->gravity), out[POTENTIAL]);
	CLOUD_ADD(&points, i, cloud_height(&u[POINT_POSITION], i, b->dim, b->gravity), out[POTENTIAL]);
	if (u[POINT_ENERGY].real[0]) CLOUD_ADD(&points, i, u[POINT_ENERGY].real[0][i], out[ELASTIC]);
	const int rows[] = { STORED, SHEARED, DAMPED, RUBBED, EXCHANGED },
			  to[] = { SPRINGS, TANGENTIAL, DASHPOTS, SLIDING, COUPLING };
	for (int k = 0; k < 5; k++) out[to[k]] = u[rows[k]].real[0] ? u[rows[k]].real[0][0] : 0;
	for (uint32_t i = 0; u[WORK].real[0] && i < b->count[WORK]; i++) out[BODIES] -= u[WORK].real[0][i];
	if (u[STRAINED].real[0]) out[BODIES] -= u[STRAINED].real[0][0];
	for (int row = GRAINS_LEFT; row <= POINTS_POURED_HEIGHT; row++)
		out[PASSED] += (row < GRAINS_POURED ? 1 : -1) * book_total(u[row].real[0], b->count[row]);
	for (int k = 0; k < SUM; k++) out[SUM] += out[k];
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.energy",
	.brief = "Energy by kind: what there is and what was lost.",
	.doc = "Makes the contact laws book what their springs hold and what dashpots and sliding take.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
