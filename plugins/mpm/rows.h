/* SPDX-License-Identifier: MIT */
/* rows - the uses of the continuum solver's stages, and the numbers of their rows */
#pragma once
#include "../common/books.h"
#include <quern/abi.h>

/* clang-format off */
#define UNSORTED_USE \
	"total.unsorted", "1", QUERN_UPDATE, QUERN_INDEX, .doc = "1: points must be sorted before the next scatter."
#define UNCOUNTED_USE(ACCESS) \
	"total.uncounted", "1", ACCESS, QUERN_INDEX, .when = "counted", \
	.doc = "1: what cells hold was counted in this step, and how fast points are spread; counts up to the next time."
#define IMPULSE_USE "body.impulse", "N s", QUERN_UPDATE, QUERN_VECTOR, .flags = QUERN_OPTIONAL
#define TWIST_USE "body.twist", "N m s", QUERN_UPDATE, QUERN_AXIAL, .flags = QUERN_OPTIONAL
#define WORK_USE "body.work", "J", QUERN_UPDATE, QUERN_SCALAR, .flags = QUERN_OPTIONAL
#define FACES_USE \
	"total.faces", "N s", QUERN_UPDATE, QUERN_VECTOR, .flags = QUERN_OPTIONAL, \
	.doc = "Impulse on the continuum by closed faces of the domain and by the limit on light nodes."

#define FILL_USES(X) \
	X(FILL_POSITION, "point.position", "m", QUERN_WRITE, QUERN_VECTOR, .flags = QUERN_SHOWN, .doc = "Position.") \
	X(FILL_VELOCITY, "point.velocity", "m/s", QUERN_WRITE, QUERN_VECTOR, .doc = "Velocity.") \
	X(FILL_MASS, "point.mass", "kg", QUERN_WRITE, QUERN_SCALAR, .doc = "Mass, unweighted.") \
	X(FILL_VOLUME, "point.volume", "m^3", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_SHOWN, \
		.doc = "Volume, unweighted.") \
	X(FILL_STRESS, "point.stress", "Pa", QUERN_WRITE, QUERN_SYMMETRIC, .doc = "Cauchy stress, tension positive.") \
	X(FILL_WEIGHT, "point.weight", "1", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, .initial = 1, \
		.doc = "Share of its mass that the point carries.") \
	X(FILL_ENERGY, "point.energy", "J/kg", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, \
		.doc = "Stored elastic energy.") \
	X(FILL_UNSORTED, UNSORTED_USE) \
	X(FILL_AFFINE, "point.affine", "1/s", QUERN_READ, QUERN_TENSOR, .flags = QUERN_OPTIONAL) \
	X(FILL_LEFT, "point_face.mass", "kg", QUERN_READ, QUERN_SCALAR, .when = "outlets") \
	X(FILL_POURED, "point_source.mass", "kg", QUERN_READ, QUERN_SCALAR, .when = "sources")
QUERN_USE_ENUM(FILL_USES);

/* new entries alone are written, before anybody else in the step looks at one */
#define POUR_USES(X) \
	X(POUR_POSITION, "point.position", "m", QUERN_WRITE, QUERN_VECTOR) \
	X(POUR_VELOCITY, "point.velocity", "m/s", QUERN_WRITE, QUERN_VECTOR) \
	X(POUR_POINT_MASS, "point.mass", "kg", QUERN_WRITE, QUERN_SCALAR) \
	X(POUR_VOLUME, "point.volume", "m^3", QUERN_WRITE, QUERN_SCALAR) \
	X(POUR_STRESS, "point.stress", "Pa", QUERN_WRITE, QUERN_SYMMETRIC) \
	X(POUR_UNSORTED, UNSORTED_USE) \
	BOOK_ROWS(X, POURED, "point_source", "sources") \
	X(POUR_WAITING, WAITING_USE("point_source")) \
	X(POUR_LATE, LATE_USE("point_source")) \
	X(POUR_DUE, DUE_USE("point_source")) \
	X(POUR_LOOKED, LOOKED_USE("point_source"))
QUERN_USE_ENUM(POUR_USES);

#define RESAMPLE_USES(X) \
	X(RESAMPLE_POSITION, "point.position", "m", QUERN_UPDATE, QUERN_VECTOR, .rule = QUERN_KEEPS) \
	X(RESAMPLE_VELOCITY, "point.velocity", "m/s", QUERN_UPDATE, QUERN_VECTOR, .rule = QUERN_KEEPS) \
	X(RESAMPLE_MASS, "point.mass", "kg", QUERN_UPDATE, QUERN_SCALAR, .rule = QUERN_KEEPS) \
	X(RESAMPLE_VOLUME, "point.volume", "m^3", QUERN_UPDATE, QUERN_SCALAR, .rule = QUERN_KEEPS) \
	X(RESAMPLE_STRESS, "point.stress", "Pa", QUERN_UPDATE, QUERN_SYMMETRIC, .rule = QUERN_KEEPS) \
	X(RESAMPLE_WEIGHT, "point.weight", "1", QUERN_UPDATE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, .rule = QUERN_KEEPS) \
	X(RESAMPLE_UNSORTED, UNSORTED_USE)
QUERN_USE_ENUM(RESAMPLE_USES);

#define OUTLET_USES(X) \
	X(OUT_POSITION, "point.position", "m", QUERN_READ, QUERN_VECTOR) \
	X(OUT_VELOCITY, "point.velocity", "m/s", QUERN_READ, QUERN_VECTOR) \
	X(OUT_MASS, "point.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(OUT_WEIGHT, "point.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(OUT_ENERGY, "point.energy", "J/kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(OUT_PULL, PULL_USE) \
	BOOK_ROWS(X, LEFT, "point_face", "outlets")
QUERN_USE_ENUM(OUTLET_USES);

#define WATCH_USES(X) \
	X(WATCH_POSITION, "point.position", "m", QUERN_READ, QUERN_VECTOR) \
	X(WATCH_VELOCITY, "point.velocity", "m/s", QUERN_READ, QUERN_VECTOR) \
	X(WATCH_MASS, "point.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(WATCH_VOLUME, "point.volume", "m^3", QUERN_READ, QUERN_SCALAR) \
	X(WATCH_STRESS, "point.stress", "Pa", QUERN_READ, QUERN_SYMMETRIC) \
	X(WATCH_WEIGHT, "point.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(WATCH_BODY_WORK, "body.work", "J", QUERN_READ, QUERN_SCALAR, .when = "moving") \
	X(WATCH_POURED, "point_source.energy", "J", QUERN_READ, QUERN_SCALAR, .when = "sources") \
	X(WATCH_POURED_HEIGHT, "point_source.potential", "J", QUERN_READ, QUERN_SCALAR, .when = "sources") \
	X(WATCH_LEFT_HEIGHT, "point_face.potential", "J", QUERN_READ, QUERN_SCALAR, .when = "outlets") \
	X(WATCH_BEGUN, "total.watch_begun", "1", QUERN_UPDATE, QUERN_INDEX, .doc = "1: the first look has been.") \
	X(WATCH_LEAST, "total.watch_least", "J", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "Of all energy, less what was given: the least since a stage has begun.") \
	X(WATCH_MOST, "total.watch_held", "J", QUERN_UPDATE, QUERN_SCALAR, .doc = "The most that stress has held since then.") \
	X(WATCH_WORK, "total.watch_work", "J", QUERN_UPDATE, QUERN_SCALAR, .doc = "By gravity along periodic axes since.") \
	X(WATCH_GIVEN, "total.watch_given", "J", QUERN_UPDATE, QUERN_SCALAR, .doc = "Otherwise, until then.") \
	X(WATCH_POWER, "total.watch_power", "W", QUERN_UPDATE, QUERN_SCALAR, .doc = "Of gravity along periodic axes at the last look.") \
	X(WATCH_TIME, "total.watch_time", "s", QUERN_UPDATE, QUERN_SCALAR, .doc = "Of the last look.") \
	X(WATCH_PRESSED, "total.watch_pressed", "1", QUERN_UPDATE, QUERN_INDEX, .doc = "1: it was said that material is pressed too far.")
QUERN_USE_ENUM(WATCH_USES);

#define HOLD_USES(X) \
	X(HOLD_POSITION, "point.position", "m", QUERN_UPDATE, QUERN_VECTOR) \
	X(HOLD_UNSORTED, UNSORTED_USE) \
	X(HOLD_AFFINE, "point.affine", "1/s", QUERN_UPDATE, QUERN_TENSOR, .flags = QUERN_OPTIONAL, .with = "point.affine")
QUERN_USE_ENUM(HOLD_USES);

#define SORT_USES(X) \
	X(SORT_POSITION, "point.position", "m", QUERN_UPDATE, QUERN_VECTOR) \
	X(SORT_UNSORTED, UNSORTED_USE)
QUERN_USE_ENUM(SORT_USES);

#define SCATTER_USES(X) \
	X(SCATTER_POSITION, "point.position", "m", QUERN_READ, QUERN_VECTOR) \
	X(SCATTER_VELOCITY, "point.velocity", "m/s", QUERN_READ, QUERN_VECTOR) \
	X(SCATTER_MASS, "point.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(SCATTER_VOLUME, "point.volume", "m^3", QUERN_READ, QUERN_SCALAR) \
	X(SCATTER_STRESS, "point.stress", "Pa", QUERN_READ, QUERN_SYMMETRIC) \
	X(SCATTER_DASHPOT, "point.dashpot", "Pa", QUERN_READ, QUERN_SYMMETRIC, .when = "damped") \
	X(SCATTER_WEIGHT, "point.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(SCATTER_AFFINE, "point.affine", "1/s", QUERN_READ, QUERN_TENSOR, .flags = QUERN_OPTIONAL) \
	X(SCATTER_NODE_MASS, "node.mass", "kg", QUERN_ADD, QUERN_SCALAR, .doc = "Weighted mass.") \
	X(SCATTER_NODE_MOMENTUM, "node.momentum", "kg m/s", QUERN_ADD, QUERN_VECTOR, .doc = "Weighted momentum.") \
	X(SCATTER_NODE_HELD, "node.held", "kg", QUERN_ADD, QUERN_SCALAR, \
		.doc = "Mass of the cell above the node, by hats around the centres of cells: of a continuum alone, where it is counted.") \
	X(SCATTER_NODE_FORCE, "node.force", "N", QUERN_ADD, QUERN_VECTOR, .doc = "Weighted internal force.") \
	X(SCATTER_AFFINE_WANTED, "point.affine", "1/s", QUERN_READ, QUERN_TENSOR, .when = "affine") \
	X(SCATTER_UNCOUNTED, UNCOUNTED_USE(QUERN_UPDATE))
QUERN_USE_ENUM(SCATTER_USES);

#define NODES_USES(X) \
	X(NODES_NODE, "node.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(NODES_MOTION, "motion.velocity", "m/s", QUERN_WRITE, QUERN_VECTOR, .doc = "Velocity.") \
	X(NODES_IMPULSE, IMPULSE_USE) \
	X(NODES_FACES, FACES_USE) \
	X(NODES_TWIST, TWIST_USE) \
	X(NODES_WORK, WORK_USE) \
	X(NODES_CHANGE, "motion.change", "m/s", QUERN_WRITE, QUERN_VECTOR, .doc = "Velocity gained in this step.") \
	X(NODES_DENSITY, "motion.density", "kg/m^3", QUERN_WRITE, QUERN_SCALAR, \
		.doc = "Mass of a node over the volume that faces and bodies leave it; below 0 where bodies leave hardly any.") \
	X(NODES_NODE_MOMENTUM, "node.momentum", "kg m/s", QUERN_READ, QUERN_VECTOR) \
	X(NODES_NODE_FORCE, "node.force", "N", QUERN_READ, QUERN_VECTOR) \
	X(NODES_GRIP, "motion.grip", "m/s", QUERN_WRITE, QUERN_SCALAR, .when = "rough", \
		.doc = "Change of velocity that rough bodies could still have held.")
QUERN_USE_ENUM(NODES_USES);

#define WALLS_USES(X) \
	X(WALLS_MOTION, "motion.velocity", "m/s", QUERN_UPDATE, QUERN_VECTOR) \
	X(WALLS_NODE, "node.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(WALLS_IMPULSE, IMPULSE_USE) \
	X(WALLS_FACES, FACES_USE) \
	X(WALLS_TWIST, TWIST_USE) \
	X(WALLS_WORK, WORK_USE) \
	X(WALLS_CHANGE, "motion.change", "m/s", QUERN_UPDATE, QUERN_VECTOR) \
	X(WALLS_GRIP, "motion.grip", "m/s", QUERN_UPDATE, QUERN_SCALAR, .when = "rough")
QUERN_USE_ENUM(WALLS_USES);

/* point.affine is written if somebody wants it sent; that it shall be written out does not make it */
#define GATHER_USES(X) \
	X(GATHER_MOTION, "motion.velocity", "m/s", QUERN_READ, QUERN_VECTOR) \
	X(GATHER_NODE, "node.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(GATHER_POSITION, "point.position", "m", QUERN_UPDATE, QUERN_VECTOR) \
	X(GATHER_VELOCITY, "point.velocity", "m/s", QUERN_UPDATE, QUERN_VECTOR) \
	X(GATHER_MASS, "point.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(GATHER_VOLUME, "point.volume", "m^3", QUERN_UPDATE, QUERN_SCALAR) \
	X(GATHER_STRESS, "point.stress", "Pa", QUERN_UPDATE, QUERN_SYMMETRIC) \
	X(GATHER_DASHPOT, "point.dashpot", "Pa", QUERN_UPDATE, QUERN_SYMMETRIC, .when = "damped", .rule = QUERN_MEANS, \
		.doc = "Stress of the dashpots beside the elastic one.") \
	X(GATHER_WEIGHT, "point.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(GATHER_GRADIENT, "point.gradient", "1/s", QUERN_WRITE, QUERN_TENSOR, .flags = QUERN_OPTIONAL, \
		.doc = "Velocity gradient of the last step.") \
	X(GATHER_AFFINE, "point.affine", "1/s", QUERN_WRITE, QUERN_TENSOR, .flags = QUERN_OPTIONAL, .rule = QUERN_MEANS, \
		.with = "point.affine", \
		.doc = "What points send with their velocity: the same, or what the transfer gives in its place.") \
	X(GATHER_PRESSURE, "point.pressure", "Pa", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, \
		.doc = "Minus the mean normal stress.") \
	X(GATHER_ENERGY, "point.energy", "J/kg", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, \
		.doc = "Stored elastic energy.") \
	X(GATHER_WAVE, "point.wave_speed", "m/s", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, \
		.doc = "Of pressure waves.") \
	X(GATHER_UNSORTED, UNSORTED_USE) \
	X(GATHER_CHANGE, "motion.change", "m/s", QUERN_READ, QUERN_VECTOR) \
	X(GATHER_DENSITY, "motion.density", "kg/m^3", QUERN_READ, QUERN_SCALAR) \
	X(GATHER_FOLLOWING, "point.following", "1/s", QUERN_UPDATE, QUERN_SCALAR, .when = "alone", \
		.doc = "Rate at which the density goes to that of the cell, over the density.") \
	X(GATHER_AROUND, "point.around", "Pa", QUERN_UPDATE, QUERN_SCALAR, .when = "alone", \
		.doc = "Mean pressure of the cell when it was counted.") \
	X(GATHER_SPREADING, "point.spreading", "1/s", QUERN_UPDATE, QUERN_VECTOR, .when = "counted", .rule = QUERN_OWN, \
		.doc = "Rate at which the point would go, from the middle of its cell, to where others are not, in cells.") \
	X(GATHER_UNCOUNTED, UNCOUNTED_USE(QUERN_READ)) \
	X(GATHER_HELD, "node.held", "kg", QUERN_READ, QUERN_SCALAR, .when = "alone") \
	X(GATHER_CROWDING, "cell.crowding", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(GATHER_FULLNESS, "cell.fullness", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(GATHER_FULL, "total.full", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL)
QUERN_USE_ENUM(GATHER_USES);
/* clang-format on */
