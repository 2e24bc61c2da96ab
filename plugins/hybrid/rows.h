/* SPDX-License-Identifier: MIT */
/* rows - the uses of the hybrid solver's stages, and the numbers of their rows */
#pragma once
#include "../common/books.h"
#include <quern/abi.h>

/* clang-format off */
#define FIXED_USE "grain.fixed", "1", QUERN_READ, QUERN_INDEX, .flags = QUERN_OPTIONAL

/* sees everything */
#define UPDATE_USES(X) \
	X(U_GRAIN_POSITION, "grain.position", "m", QUERN_UPDATE, QUERN_VECTOR) \
	X(U_GRAIN_VELOCITY, "grain.velocity", "m/s", QUERN_UPDATE, QUERN_VECTOR) \
	X(U_GRAIN_SPIN, "grain.spin", "rad/s", QUERN_UPDATE, QUERN_AXIAL, .flags = QUERN_OPTIONAL) \
	X(U_GRAIN_RADIUS, "grain.radius", "m", QUERN_UPDATE, QUERN_SCALAR) \
	X(U_GRAIN_MASS, "grain.mass", "kg", QUERN_UPDATE, QUERN_SCALAR) \
	X(U_GRAIN_WEIGHT, "grain.weight", "1", QUERN_UPDATE, QUERN_SCALAR, .initial = 1, .flags = QUERN_SHOWN) \
	X(U_GRAIN_FIXED, FIXED_USE) \
	X(U_LENT, "grain.lent", "m/s^2", QUERN_UPDATE, QUERN_VECTOR, \
		.doc = "What the coupling has given in the last long step, and gives ahead in this one.") \
	X(U_BORNE, "contact.borne", "N", QUERN_READ, QUERN_VECTOR) \
	X(U_CONTACT_FIRST, "contact.first", "1", QUERN_READ, QUERN_INDEX, .target = "grain") \
	X(U_CONTACT_SECOND, "contact.second", "1", QUERN_READ, QUERN_INDEX, .target = "grain") \
	X(U_GRAIN_ID, "grain.id", "1", QUERN_READ, QUERN_ID) \
	X(U_GRAIN_NORMAL, "grain.zone_normal", "1", QUERN_WRITE, QUERN_VECTOR, .flags = QUERN_OPTIONAL, \
		.doc = "Unit normal of the zone's level set.") \
	X(U_POINT_POSITION, "point.position", "m", QUERN_UPDATE, QUERN_VECTOR, .rule = QUERN_KEEPS) \
	X(U_POINT_VELOCITY, "point.velocity", "m/s", QUERN_UPDATE, QUERN_VECTOR, .rule = QUERN_KEEPS) \
	X(U_POINT_MASS, "point.mass", "kg", QUERN_UPDATE, QUERN_SCALAR, .rule = QUERN_KEEPS) \
	X(U_POINT_VOLUME, "point.volume", "m^3", QUERN_UPDATE, QUERN_SCALAR, .rule = QUERN_KEEPS) \
	X(U_POINT_STRESS, "point.stress", "Pa", QUERN_UPDATE, QUERN_SYMMETRIC, .rule = QUERN_KEEPS) \
	X(U_POINT_WEIGHT, "point.weight", "1", QUERN_UPDATE, QUERN_SCALAR, .initial = 1, .flags = QUERN_SHOWN, \
		.rule = QUERN_KEEPS) \
	X(U_POINT_NORMAL, "point.zone_normal", "1", QUERN_WRITE, QUERN_VECTOR, .flags = QUERN_OPTIONAL, \
		.doc = "Unit normal of the zone's level set.") \
	X(U_ZONE, "cell.zone", "1", QUERN_UPDATE, QUERN_INDEX, .flags = QUERN_SHOWN, \
		.doc = "0: grains, 1: both, 2: continuum.") \
	X(U_FRACTION, "cell.packing_fraction", "1", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, \
		.doc = "Of grains; 1 where the continuum fills the cell.") \
	X(U_SHEAR_RATE, "cell.shear_rate", "1/s", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, \
		.doc = "Of the mean velocity of both.") \
	X(U_INERTIAL, "cell.inertial_number", "1", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, \
		.doc = "Shear rate times d sqrt(rho/p).") \
	X(U_RATE_CHANGE, "cell.rate_change", "1/s", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, \
		.doc = "Of the shear rate over a mean diameter.") \
	X(U_PRESSURE, "cell.pressure", "Pa", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, \
		.doc = "Of contacts and points, in their shares.") \
	X(U_AGITATION, "cell.agitation", "1", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, \
		.doc = "Grain density times granular temperature over the pressure; 0 without pressure.") \
	X(U_AVERAGED, "cell.averaged", "1", QUERN_UPDATE, QUERN_INDEX, .when = "averages", \
		.doc = "Updates that the means are of.") \
	X(U_MEAN_VELOCITY, "cell.mean_velocity", "m/s", QUERN_UPDATE, QUERN_VECTOR, .when = "averages", \
		.doc = "Of both, mean over the last updates.") \
	X(U_MEAN_PRESSURE, "cell.mean_pressure", "Pa", QUERN_UPDATE, QUERN_SCALAR, .when = "averages", \
		.doc = "Of both, mean over the last updates.") \
	X(U_MEAN_SCATTER, "cell.mean_scatter", "m^2/s^2", QUERN_UPDATE, QUERN_SCALAR, .when = "averages", \
		.doc = "Mean square of velocities less that of their mean, mean over the last updates.") \
	X(U_MARKED, "cell.marked", "1", QUERN_UPDATE, QUERN_INDEX, .when = "marks", \
		.doc = "Bit o: oracle o has marked the cell.") \
	X(U_OWED, "cell.owed", "kg", QUERN_UPDATE, QUERN_SCALAR, .doc = "Mass that neither grains nor points carry.") \
	X(U_OWED_MOMENTUM, "cell.owed_momentum", "kg m/s", QUERN_UPDATE, QUERN_VECTOR, \
		.doc = "Momentum that neither grains nor points carry.") \
	X(U_CROWDING, "cell.crowding", "1", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "What a cell and those around it hold, over what fills them, mean over the last updates.") \
	X(U_FULLNESS, "cell.fullness", "1", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "What a cell itself held at the last update, over what fills its open room.") \
	X(U_FULL, "total.full", "1", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "Crowding within the material, when there first was a continuum; 1 if that had not settled, or was little.") \
	X(U_CARRIED, "cell.carried", "kg", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "What both clouds carry in a cell, mean over the last updates.") \
	X(U_ROOM, "cell.room", "kg", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "What would fill its open room without stress, mean over the last updates.") \
	X(U_DENSEST, "total.densest", "1", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "Density of the densest place over the stress-free one, at the last update.") \
	X(U_DENSEST_EVER, "total.densest_ever", "1", QUERN_UPDATE, QUERN_SCALAR, .doc = "The largest of these so far.") \
	X(U_UNCARRIED, "total.uncarried", "1", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "Share of the mass by which grains and points have carried too little or too much, at worst.") \
	X(U_STRESS, "cell.stress", "Pa", QUERN_UPDATE, QUERN_SYMMETRIC, \
		.doc = "Sum of the contact stress over the samples since the last update.") \
	X(U_SAMPLES, "total.samples", "1", QUERN_UPDATE, QUERN_SCALAR, .doc = "Samples of the contact stress.") \
	X(U_DRAWS, "total.draws", "1", QUERN_UPDATE, QUERN_INDEX, .doc = "Radii drawn for new grains.") \
	X(U_WAITING, "waiting.draw", "1", QUERN_UPDATE, QUERN_INDEX, \
		.doc = "Number of the radius of a grain that waits for room.") \
	X(U_UPDATES, "total.updates", "1", QUERN_UPDATE, QUERN_INDEX, .doc = "Zone updates so far.") \
	X(U_MASS, "total.mass_initial", "kg", QUERN_UPDATE, QUERN_SCALAR, .doc = "Mass at the release.") \
	X(U_DISPLACEMENT, "total.displacement", "m", QUERN_UPDATE, QUERN_SCALAR, .initial = INFINITY) \
	X(U_UNSORTED, "total.unsorted", "1", QUERN_UPDATE, QUERN_INDEX) \
	X(U_MASS_DEFECT, "total.mass_defect", "1", QUERN_READ, QUERN_SCALAR) \
	X(U_MOMENTUM_DEFECT, "total.momentum_defect", "1", QUERN_READ, QUERN_SCALAR) \
	X(U_WEIGHT, "cell.weight", "1", QUERN_UPDATE, QUERN_SCALAR, .when = "ramped", \
		.doc = "Share of the continuum: 0 where there are grains alone, 1 where there are none.") \
	X(U_PASSED, "total.passed", "kg", QUERN_READ, QUERN_SCALAR, .when = "passes") \
	X(U_LEFT, "grain_face.mass", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(U_POURED, "grain_source.mass", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL)
QUERN_USE_ENUM(UPDATE_USES);

#define SAMPLE_USES(X) \
	X(S_FORCE, "contact.force", "N", QUERN_READ, QUERN_VECTOR) \
	X(S_FIRST, "contact.first", "1", QUERN_READ, QUERN_INDEX, .target = "grain") \
	X(S_SECOND, "contact.second", "1", QUERN_READ, QUERN_INDEX, .target = "grain") \
	X(S_TOUCH_FORCE, "touch.force", "N", QUERN_READ, QUERN_VECTOR, .flags = QUERN_WANTED) \
	X(S_TOUCH_GRAIN, "touch.grain", "1", QUERN_READ, QUERN_INDEX, .target = "grain", .flags = QUERN_OPTIONAL) \
	X(S_TOUCH_BODY, "touch.body", "1", QUERN_READ, QUERN_INDEX, .target = "body", .flags = QUERN_OPTIONAL) \
	X(S_POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR) \
	X(S_RADIUS, "grain.radius", "m", QUERN_READ, QUERN_SCALAR) \
	X(S_FIXED, FIXED_USE) \
	X(S_BORNE, "contact.borne", "N", QUERN_UPDATE, QUERN_VECTOR, .flags = QUERN_RELEASED, \
		.doc = "Force of the last substep before an update, whoever looks in between.") \
	X(S_STRESS, "cell.stress", "Pa", QUERN_UPDATE, QUERN_SYMMETRIC, .flags = QUERN_RELEASED) \
	X(S_SAMPLES, "total.samples", "1", QUERN_UPDATE, QUERN_SCALAR, .flags = QUERN_RELEASED) \
	X(S_TOUCH_FEATURE, "touch.feature", "1", QUERN_READ, QUERN_INDEX, .flags = QUERN_OPTIONAL)
QUERN_USE_ENUM(SAMPLE_USES);

#define RASTER_USES(X) \
	X(R_POSITION, "grain.position", "m", QUERN_UPDATE, QUERN_VECTOR) \
	X(R_VELOCITY, "grain.velocity", "m/s", QUERN_UPDATE, QUERN_VECTOR) \
	X(R_LENT, "grain.lent", "m/s^2", QUERN_UPDATE, QUERN_VECTOR) \
	X(R_ANCHOR, "grain.anchor", "m", QUERN_READ, QUERN_VECTOR) \
	X(R_DISPLACEMENT, "total.displacement", "m", QUERN_UPDATE, QUERN_SCALAR, .initial = INFINITY) \
	X(R_MASS, "grain.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(R_WEIGHT, "grain.weight", "1", QUERN_READ, QUERN_SCALAR) \
	X(R_FIXED, FIXED_USE) \
	X(R_NODE, "node.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(R_MOTION, "motion.velocity", "m/s", QUERN_READ, QUERN_VECTOR) \
	X(R_MIXTURE, "mixture.mass", "kg", QUERN_ADD, QUERN_SCALAR, .doc = "Weighted mass of grains.") \
	X(R_MIXTURE_MOMENTUM, "mixture.momentum", "kg m/s", QUERN_ADD, QUERN_VECTOR, \
		.doc = "Weighted momentum of grains.")
QUERN_USE_ENUM(RASTER_USES);

#define COUPLE_USES(X) \
	X(C_NODE, "node.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(C_MOTION, "motion.velocity", "m/s", QUERN_UPDATE, QUERN_VECTOR) \
	X(C_MIXTURE, "mixture.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(C_EXCHANGE, "total.exchange_defect", "1", QUERN_WRITE, QUERN_SCALAR, \
		.doc = "Momentum that the coupling made, over that of the node: the worst node.") \
	X(C_ENERGY, "total.exchanged", "J", QUERN_UPDATE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, \
		.doc = "Taken by the coupling so far.") \
	X(C_CHANGE, "motion.change", "m/s", QUERN_UPDATE, QUERN_VECTOR) \
	X(C_DENSITY, "motion.density", "kg/m^3", QUERN_UPDATE, QUERN_SCALAR) \
	X(C_MIXTURE_MOMENTUM, "mixture.momentum", "kg m/s", QUERN_READ, QUERN_VECTOR) \
	X(C_MIXTURE_CHANGE, "mixture.change", "m/s", QUERN_ADD, QUERN_VECTOR, .doc = "What the coupling changes.")
QUERN_USE_ENUM(COUPLE_USES);

#define BACK_USES(X) \
	X(B_POSITION, "grain.position", "m", QUERN_UPDATE, QUERN_VECTOR) \
	X(B_VELOCITY, "grain.velocity", "m/s", QUERN_UPDATE, QUERN_VECTOR) \
	X(B_MASS, "grain.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(B_WEIGHT, "grain.weight", "1", QUERN_READ, QUERN_SCALAR) \
	X(B_FIXED, FIXED_USE) \
	X(B_LENT, "grain.lent", "m/s^2", QUERN_UPDATE, QUERN_VECTOR) \
	X(B_ANCHOR, "grain.anchor", "m", QUERN_READ, QUERN_VECTOR) \
	X(B_NODE, "node.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(B_MIXTURE, "mixture.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(B_DISPLACEMENT, "total.displacement", "m", QUERN_UPDATE, QUERN_SCALAR, .initial = INFINITY) \
	X(B_MIXTURE_MOMENTUM, "mixture.momentum", "kg m/s", QUERN_READ, QUERN_VECTOR) \
	X(B_MIXTURE_CHANGE, "mixture.change", "m/s", QUERN_READ, QUERN_VECTOR) \
	X(B_MOTION, "motion.velocity", "m/s", QUERN_UPDATE, QUERN_VECTOR, .when = "solves") \
	X(B_MOTION_CHANGE, "motion.change", "m/s", QUERN_UPDATE, QUERN_VECTOR, .when = "solves") \
	X(B_EXCHANGE, "total.exchange_defect", "1", QUERN_UPDATE, QUERN_SCALAR, .when = "solves") \
	X(B_ENERGY, "total.exchanged", "J", QUERN_UPDATE, QUERN_SCALAR, .when = "solves", .flags = QUERN_OPTIONAL)
QUERN_USE_ENUM(BACK_USES);

#define GROW_USES(X) \
	X(G_POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR) \
	X(G_RADIUS, "grain.radius", "m", QUERN_UPDATE, QUERN_SCALAR) \
	X(G_MASS, "grain.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(G_FIXED, FIXED_USE) \
	X(G_FIRST, "contact.first", "1", QUERN_READ, QUERN_INDEX, .target = "grain") \
	X(G_SECOND, "contact.second", "1", QUERN_READ, QUERN_INDEX, .target = "grain") \
	X(G_GROWN, "total.grown", "m", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "By how much a radius has grown since the last list, at most.")
QUERN_USE_ENUM(GROW_USES);

#define AUDIT_USES(X) \
	X(A_GRAIN_VELOCITY, "grain.velocity", "m/s", QUERN_READ, QUERN_VECTOR) \
	X(A_GRAIN_MASS, "grain.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(A_GRAIN_WEIGHT, "grain.weight", "1", QUERN_READ, QUERN_SCALAR) \
	X(A_GRAIN_FIXED, FIXED_USE) \
	X(A_POINT_VELOCITY, "point.velocity", "m/s", QUERN_READ, QUERN_VECTOR) \
	X(A_POINT_MASS, "point.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(A_POINT_WEIGHT, "point.weight", "1", QUERN_READ, QUERN_SCALAR) \
	X(A_OWED, "cell.owed", "kg", QUERN_READ, QUERN_SCALAR) \
	X(A_OWED_MOMENTUM, "cell.owed_momentum", "kg m/s", QUERN_READ, QUERN_VECTOR) \
	X(A_BODY, "body.impulse", "N s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_WANTED) \
	X(A_BODY_WORK, "body.work", "J", QUERN_READ, QUERN_SCALAR, .when = "moving") \
	X(A_FACES, "total.faces", "N s", QUERN_READ, QUERN_VECTOR) \
	X(A_SUPPORT, "total.support", "N s", QUERN_READ, QUERN_VECTOR) \
	X(A_EXCHANGE, "total.exchange_defect", "1", QUERN_READ, QUERN_SCALAR) \
	X(A_GRAVITY, "total.gravity_impulse", "N s", QUERN_UPDATE, QUERN_VECTOR, \
		.doc = "Given by gravity since the first audit.") \
	X(A_MASS, "total.audit_mass", "kg", QUERN_UPDATE, QUERN_SCALAR, .doc = "Carried and owed at the first audit.") \
	X(A_MOMENTUM, "total.audit_momentum", "kg m/s", QUERN_UPDATE, QUERN_VECTOR, \
		.doc = "Carried and owed at the first audit, without impulses.") \
	X(A_SCALE, "total.audit_scale", "kg m/s", QUERN_UPDATE, QUERN_SCALAR, .doc = "Largest sum of w m |v| so far.") \
	X(A_LEFT, "total.audit_left", "kg m/s", QUERN_UPDATE, QUERN_VECTOR, \
		.doc = "What the momentum invariant was off by after the last step.") \
	X(A_AUDITS, "total.audits", "1", QUERN_UPDATE, QUERN_INDEX, .doc = "1: the first audit has been.") \
	X(A_MASS_DEFECT, "total.mass_defect", "1", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "Of the mass invariant, relative: the worst so far.") \
	X(A_MOMENTUM_DEFECT, "total.momentum_defect", "1", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "Of the momentum invariant, relative: the worst so far.") \
	X(A_ENERGY, "total.audit_energy", "J", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "Of motion and in springs when it was last set down: no less than that.") \
	X(A_WORK, "total.gravity_work", "J", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "Done by gravity since then.") \
	X(A_FORCE, "contact.force", "N", QUERN_READ, QUERN_VECTOR) \
	X(A_FIRST, "contact.first", "1", QUERN_READ, QUERN_INDEX, .target = "grain") \
	X(A_SECOND, "contact.second", "1", QUERN_READ, QUERN_INDEX, .target = "grain") \
	X(A_GRAIN_POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR) \
	X(A_GRAIN_RADIUS, "grain.radius", "m", QUERN_READ, QUERN_SCALAR) \
	X(A_GRAIN_SPIN, "grain.spin", "rad/s", QUERN_READ, QUERN_AXIAL, .flags = QUERN_OPTIONAL) \
	X(A_POINT_VOLUME, "point.volume", "m^3", QUERN_READ, QUERN_SCALAR) \
	X(A_POINT_STRESS, "point.stress", "Pa", QUERN_READ, QUERN_SYMMETRIC) \
	X(A_GRAIN_LEFT, "grain_face.mass", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(A_GRAIN_LEFT_MOMENTUM, "grain_face.momentum", "kg m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(A_POINT_LEFT, "point_face.mass", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(A_POINT_LEFT_MOMENTUM, "point_face.momentum", "kg m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(A_POURED, "grain_source.mass", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(A_POURED_MOMENTUM, "grain_source.momentum", "kg m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(A_POURED_ENERGY, "grain_source.energy", "J", QUERN_READ, QUERN_SCALAR, .with = "grain_source.mass") \
	X(A_PULL, "total.outlet_pull", "kg s", QUERN_UPDATE, QUERN_SCALAR, .when = "passes") \
	X(A_PASSED, "total.passed", "kg", QUERN_UPDATE, QUERN_SCALAR, .when = "passes", \
		.doc = "Has left the domain, less what was poured.")
QUERN_USE_ENUM(AUDIT_USES);
/* clang-format on */
