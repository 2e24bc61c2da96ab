/* SPDX-License-Identifier: MIT */
/* rows - the uses of the grain solver's stages, and the numbers of their rows */
#pragma once
#include "../common/books.h"
#include <math.h>
#include <quern/abi.h>

/* clang-format off */
#define DISPLACEMENT_USE \
	"total.displacement", "m", QUERN_UPDATE, QUERN_SCALAR, .initial = INFINITY, \
	.doc = "Half of how far two grains can have come nearer since the last list; infinite: the list is stale."
#define SWEPT_USE(access) \
	"total.swept", "m", access, QUERN_SCALAR, .when = "moving", \
	.doc = "Farthest way of a body's surface since the last list, at most."
#define FIXED_USE(access) \
	"grain.fixed", "1", access, QUERN_INDEX, .flags = QUERN_SHOWN, .when = "fixed", .doc = "1: it does not move."
#define MATERIAL_USE(access, ...) \
	"grain.material", "1", access, QUERN_INDEX, .when = "mixed", __VA_ARGS__
#define ENERGY_USE(name, access, text) \
	"total." name, "J", access, QUERN_SCALAR, .flags = QUERN_OPTIONAL | QUERN_RELEASED, .doc = text

#define BOX_ROWS(X, NAME, lengths, speeds) \
	X(NAME##_LENGTH, "total.box_length", "m", lengths, QUERN_VECTOR, .when = "boxed", \
		.doc = "Of the periodic box that is strained.") \
	X(NAME##_SPEED, "total.box_speed", "m/s", speeds, QUERN_VECTOR, .when = "boxed", .doc = "Rate of its lengths.") \
	X(NAME##_OFFSET, "total.box_offset", "m", lengths, QUERN_SCALAR, .when = "boxed", \
		.doc = "By which the image across y lies further along x.") \
	X(NAME##_SLIDE, "total.box_slide", "m/s", speeds, QUERN_SCALAR, .when = "boxed", .doc = "Rate of the offset.")
#define BOX_LISTED_ROWS(X, NAME, access) \
	X(NAME##_LISTED, "total.box_listed", "m", access, QUERN_VECTOR, .when = "boxed", \
		.doc = "Lengths of the box when the list was made.") \
	X(NAME##_LISTED_OFFSET, "total.box_listed_offset", "m", access, QUERN_SCALAR, .when = "boxed", \
		.doc = "Its offset then.")
#define BOX_BOOK_ROWS(X, NAME, access) \
	X(NAME##_WORK, "total.box_work", "J", access, QUERN_SCALAR, .when = "boxed", \
		.doc = "Done on the grains by the box so far.") \
	X(NAME##_IMPULSE, "total.box_impulse", "N s", access, QUERN_VECTOR, .when = "boxed", \
		.doc = "That the box has given to the grains so far.")

#define FILL_USES(X) \
	X(FILL_POSITION, "grain.position", "m", QUERN_WRITE, QUERN_VECTOR, .flags = QUERN_SHOWN, .doc = "Centre.") \
	X(FILL_VELOCITY, "grain.velocity", "m/s", QUERN_WRITE, QUERN_VECTOR, .doc = "Velocity.") \
	X(FILL_RADIUS, "grain.radius", "m", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_SHOWN, .doc = "Radius.") \
	X(FILL_MASS, "grain.mass", "kg", QUERN_WRITE, QUERN_SCALAR, .doc = "Mass, unweighted.") \
	X(FILL_SPIN, "grain.spin", "rad/s", QUERN_WRITE, QUERN_AXIAL, .flags = QUERN_OPTIONAL, \
		.doc = "Angular velocity.") \
	X(FILL_WEIGHT, "grain.weight", "1", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, .initial = 1, \
		.doc = "Share of its mass that the grain carries.") \
	X(FILL_FIXED, FIXED_USE(QUERN_WRITE)) \
	X(FILL_MATERIAL, MATERIAL_USE(QUERN_WRITE, .flags = QUERN_SHOWN, .doc = "Number of its material, from 0.")) \
	X(FILL_ID, "grain.id", "1", QUERN_WRITE, QUERN_ID, .flags = QUERN_SHOWN, \
		.doc = "Number of the grain, for ever.") \
	X(FILL_DISPLACEMENT, DISPLACEMENT_USE) \
	X(FILL_STIRRED, "total.stirred", "1", QUERN_UPDATE, QUERN_INDEX, \
		.doc = "While settling: the last step that was looked at and in which grains were not at rest.") \
	X(FILL_SWAY, "total.sway", "J", QUERN_UPDATE, QUERN_SCALAR, \
		.doc = "While settling: kinetic energy of the last look, below 0 if it fell; 0 after grains were stopped.") \
	X(FILL_LEFT, "grain_face.mass", "kg", QUERN_READ, QUERN_SCALAR, .when = "outlets") \
	X(FILL_POURED, "grain_source.mass", "kg", QUERN_READ, QUERN_SCALAR, .when = "sources") \
	X(FILL_FIRST, "contact.first", "1", QUERN_READ, QUERN_INDEX, .target = "grain", .flags = QUERN_OPTIONAL) \
	X(FILL_SECOND, "contact.second", "1", QUERN_READ, QUERN_INDEX, .target = "grain", .flags = QUERN_OPTIONAL) \
	BOX_ROWS(X, FILL_BOX, QUERN_WRITE, QUERN_WRITE) \
	BOX_LISTED_ROWS(X, FILL_BOX, QUERN_WRITE) \
	BOX_BOOK_ROWS(X, FILL_BOX, QUERN_WRITE) \
	X(FILL_BOX_SOLID, "total.box_solid", "1", QUERN_WRITE, QUERN_SCALAR, .when = "boxed", \
		.doc = "Volume of all grains, in m^2 or m^3.") \
	X(FILL_BOX_MASS, "total.box_mass", "kg", QUERN_WRITE, QUERN_SCALAR, .when = "boxed", .doc = "Of all grains.") \
	X(FILL_BOX_STRAIN, "total.box_strain", "1", QUERN_WRITE, QUERN_SCALAR, .when = "boxed", \
		.doc = "Shear strain of the box so far.") \
	X(FILL_BOX_LOAD, "total.box_load", "J", QUERN_WRITE, QUERN_VECTOR, .when = "boxed", \
		.doc = "Sum of force times branch over contacts, by axis, at the last step.") \
	X(FILL_BOX_WIDEST, "total.box_widest", "m", QUERN_WRITE, QUERN_SCALAR, .when = "boxed", \
		.doc = "Largest distance at which two grains may act on each other.")
QUERN_USE_ENUM(FILL_USES);

#define STRAIN_USES(X) \
	X(STRAIN_POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR) \
	X(STRAIN_VELOCITY, "grain.velocity", "m/s", QUERN_UPDATE, QUERN_VECTOR) \
	X(STRAIN_MASS, "grain.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	BOX_ROWS(X, STRAIN_BOX, QUERN_UPDATE, QUERN_UPDATE) \
	BOX_BOOK_ROWS(X, STRAIN_BOX, QUERN_UPDATE) \
	X(STRAIN_BOX_SOLID, "total.box_solid", "1", QUERN_READ, QUERN_SCALAR, .when = "boxed") \
	X(STRAIN_BOX_MASS, "total.box_mass", "kg", QUERN_READ, QUERN_SCALAR, .when = "boxed") \
	X(STRAIN_BOX_STRAIN, "total.box_strain", "1", QUERN_UPDATE, QUERN_SCALAR, .when = "boxed") \
	X(STRAIN_BOX_LOAD, "total.box_load", "J", QUERN_READ, QUERN_VECTOR, .when = "boxed")
QUERN_USE_ENUM(STRAIN_USES);

#define OPEN_USES(X) \
	X(OPEN_POSITION, "grain.position", "m", QUERN_UPDATE, QUERN_VECTOR) \
	X(OPEN_VELOCITY, "grain.velocity", "m/s", QUERN_UPDATE, QUERN_VECTOR) \
	X(OPEN_SPIN, "grain.spin", "rad/s", QUERN_UPDATE, QUERN_AXIAL, .flags = QUERN_OPTIONAL) \
	X(OPEN_ANCHOR, "grain.anchor", "m", QUERN_READ, QUERN_VECTOR) \
	X(OPEN_FIXED, FIXED_USE(QUERN_READ)) \
	X(OPEN_DISPLACEMENT, DISPLACEMENT_USE) \
	X(OPEN_SWEPT, SWEPT_USE(QUERN_READ)) \
	X(OPEN_WEIGHT, "grain.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(OPEN_LENT, "grain.lent", "m/s^2", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	BOX_ROWS(X, OPEN_BOX, QUERN_READ, QUERN_READ) \
	BOX_LISTED_ROWS(X, OPEN_BOX, QUERN_READ)
QUERN_USE_ENUM(OPEN_USES);

#define OUTLET_USES(X) \
	X(OUT_POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR) \
	X(OUT_VELOCITY, "grain.velocity", "m/s", QUERN_READ, QUERN_VECTOR) \
	X(OUT_SPIN, "grain.spin", "rad/s", QUERN_READ, QUERN_AXIAL, .flags = QUERN_OPTIONAL) \
	X(OUT_RADIUS, "grain.radius", "m", QUERN_READ, QUERN_SCALAR) \
	X(OUT_MASS, "grain.mass", "kg", QUERN_READ, QUERN_SCALAR) \
	X(OUT_WEIGHT, "grain.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(OUT_FIXED, FIXED_USE(QUERN_READ)) \
	X(OUT_PULL, PULL_USE) \
	X(OUT_LENT, "grain.lent", "m/s^2", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	BOOK_ROWS(X, LEFT, "grain_face", "outlets")
QUERN_USE_ENUM(OUTLET_USES);

/* new entries alone are written, before anybody else in the step looks at one */
#define POUR_USES(X) \
	X(POUR_POSITION, "grain.position", "m", QUERN_WRITE, QUERN_VECTOR) \
	X(POUR_VELOCITY, "grain.velocity", "m/s", QUERN_WRITE, QUERN_VECTOR) \
	X(POUR_RADIUS, "grain.radius", "m", QUERN_WRITE, QUERN_SCALAR) \
	X(POUR_MASS, "grain.mass", "kg", QUERN_WRITE, QUERN_SCALAR) \
	X(POUR_MATERIAL, MATERIAL_USE(QUERN_WRITE, .flags = 0)) \
	X(POUR_ID, "grain.id", "1", QUERN_READ, QUERN_ID) \
	X(POUR_POINT, "point.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL | QUERN_BEFORE) \
	X(POUR_POINT_VOLUME, "point.volume", "m^3", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL | QUERN_BEFORE) \
	X(POUR_DISPLACEMENT, "total.displacement", "m", QUERN_WRITE, QUERN_SCALAR, .initial = INFINITY) \
	BOOK_ROWS(X, POURED, "grain_source", "sources") \
	X(POUR_DRAWS, "grain_source.draws", "1", QUERN_UPDATE, QUERN_INDEX, .when = "sources", \
		.doc = "Radii drawn so far.") \
	X(POUR_SHARE, "grain_share.share", "1", QUERN_UPDATE, QUERN_SCALAR, .when = "blends", \
		.doc = "Of the mass that the source pours.") \
	X(POUR_SHARE_MASS, "grain_share.mass", "kg", QUERN_UPDATE, QUERN_SCALAR, .when = "blends", \
		.doc = "Poured of it, by these shares.") \
	X(POUR_SHARE_REST, "grain_share.mass_rest", "kg", QUERN_UPDATE, QUERN_SCALAR, .when = "blends", \
		.doc = "What the last bit of the mass does not hold.") \
	X(POUR_WAITING, WAITING_USE("grain_source")) \
	X(POUR_LATE, LATE_USE("grain_source")) \
	X(POUR_DUE, DUE_USE("grain_source")) \
	X(POUR_LOOKED, LOOKED_USE("grain_source"))
QUERN_USE_ENUM(POUR_USES);

/* positions are brought back through periodic faces in place, all of them before anybody looks at others */
#define NEAR_USES(X) \
	X(NEAR_POSITION, "grain.position", "m", QUERN_UPDATE, QUERN_VECTOR) \
	X(NEAR_RADIUS, "grain.radius", "m", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OTHERS) \
	X(NEAR_ID, "grain.id", "1", QUERN_READ, QUERN_ID, .flags = QUERN_OTHERS) \
	X(NEAR_FIXED, FIXED_USE(QUERN_READ)) \
	X(NEAR_MATERIAL, MATERIAL_USE(QUERN_READ, .flags = QUERN_OTHERS)) \
	X(NEAR_DISPLACEMENT, DISPLACEMENT_USE) \
	X(NEAR_SWEPT, SWEPT_USE(QUERN_WRITE)) \
	X(NEAR_GROWN, "total.grown", "m", QUERN_UPDATE, QUERN_SCALAR, .flags = QUERN_OPTIONAL | QUERN_RELEASED) \
	X(NEAR_ANCHOR, "grain.anchor", "m", QUERN_WRITE, QUERN_VECTOR, .doc = "Position when the list was made.") \
	X(NEAR_FIRST, "contact.first", "1", QUERN_WRITE, QUERN_INDEX, .target = "grain", \
		.doc = "The grain of lower id.") \
	X(NEAR_SECOND, "contact.second", "1", QUERN_WRITE, QUERN_INDEX, .target = "grain", \
		.doc = "The grain of higher id.") \
	X(NEAR_GRAIN, "touch.grain", "1", QUERN_WRITE, QUERN_INDEX, .target = "grain", .doc = "The grain.") \
	X(NEAR_BODY, "touch.body", "1", QUERN_WRITE, QUERN_INDEX, .target = "body", .doc = "The body.") \
	X(NEAR_FEATURE, "touch.feature", "1", QUERN_WRITE, QUERN_INDEX, .when = "features", \
		.doc = "The body's face, edge or vertex.") \
	X(NEAR_VELOCITY, "grain.velocity", "m/s", QUERN_UPDATE, QUERN_VECTOR, .when = "boxed") \
	X(NEAR_MASS, "grain.mass", "kg", QUERN_READ, QUERN_SCALAR, .when = "boxed") \
	BOX_ROWS(X, NEAR_BOX, QUERN_UPDATE, QUERN_UPDATE) \
	BOX_LISTED_ROWS(X, NEAR_BOX, QUERN_UPDATE) \
	BOX_BOOK_ROWS(X, NEAR_BOX, QUERN_UPDATE) \
	X(NEAR_BOX_WIDEST, "total.box_widest", "m", QUERN_UPDATE, QUERN_SCALAR, .when = "boxed")
QUERN_USE_ENUM(NEAR_USES);

/* Forces of the state as it is: what a look at them takes and what a step does. Of other grains a block reads packed rows (packed.h), made
 * before any grain moves, so that these columns need no second copy; where a law asks for one, the old one is read here. */
#define STATE_USES(X, moves, gives) \
	X(FORCE_OLD_POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR) \
	X(FORCE_OLD_VELOCITY, "grain.velocity", "m/s", QUERN_READ, QUERN_VECTOR) \
	X(FORCE_OLD_SPIN, "grain.spin", "rad/s", QUERN_READ, QUERN_AXIAL, .flags = QUERN_OPTIONAL) \
	X(FORCE_POSITION, "grain.position", "m", moves, QUERN_VECTOR) \
	X(FORCE_VELOCITY, "grain.velocity", "m/s", moves, QUERN_VECTOR) \
	X(FORCE_SPIN, "grain.spin", "rad/s", moves, QUERN_AXIAL, .flags = QUERN_OPTIONAL) \
	X(FORCE_RADIUS, "grain.radius", "m", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OTHERS) \
	X(FORCE_MASS, "grain.mass", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OTHERS) \
	X(FORCE_WEIGHT, "grain.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OTHERS | QUERN_OPTIONAL) \
	X(FORCE_LENT, "grain.lent", "m/s^2", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(FORCE_FIXED, FIXED_USE(QUERN_READ)) \
	X(FORCE_MATERIAL, MATERIAL_USE(QUERN_READ, .flags = QUERN_OTHERS)) \
	X(FORCE_FIRST, "contact.first", "1", QUERN_READ, QUERN_INDEX, .target = "grain") \
	X(FORCE_SECOND, "contact.second", "1", QUERN_READ, QUERN_INDEX, .target = "grain") \
	X(FORCE_GRAIN, "touch.grain", "1", QUERN_READ, QUERN_INDEX, .target = "grain") \
	X(FORCE_BODY, "touch.body", "1", QUERN_READ, QUERN_INDEX, .target = "body") \
	X(FORCE_FEATURE, "touch.feature", "1", QUERN_READ, QUERN_INDEX, .when = "features") \
	X(FORCE_CONTACT, "contact.force", "N", gives, QUERN_VECTOR, .flags = QUERN_OPTIONAL, \
		.doc = "On the first, unweighted.") \
	X(FORCE_TOUCH, "touch.force", "N", gives, QUERN_VECTOR, .flags = QUERN_OPTIONAL, \
		.doc = "On the grain, unweighted.") \
	X(FORCE_CONTACT_COUPLE, "contact.couple", "N m", gives, QUERN_AXIAL, .flags = QUERN_OPTIONAL, \
		.doc = "On the first, unweighted.") \
	X(FORCE_TOUCH_COUPLE, "touch.couple", "N m", gives, QUERN_AXIAL, .flags = QUERN_OPTIONAL, \
		.doc = "On the grain, unweighted.") \
	X(FORCE_SUM, "grain.force", "N", gives, QUERN_VECTOR, .flags = QUERN_OPTIONAL, \
		.doc = "Of all contacts, weighted; without gravity.") \
	X(FORCE_ID, "grain.id", "1", QUERN_READ, QUERN_ID) \
	BOX_ROWS(X, FORCE_BOX, moves, QUERN_READ)
#define LOOK_USES(X) STATE_USES(X, QUERN_READ, QUERN_UPDATE)
QUERN_USE_ENUM(LOOK_USES);

#define MOVE_USES(X) \
	X(FORCE_ANCHOR, "grain.anchor", "m", QUERN_READ, QUERN_VECTOR) \
	X(FORCE_DISPLACEMENT, DISPLACEMENT_USE) \
	X(FORCE_SWEPT, SWEPT_USE(QUERN_UPDATE)) \
	X(FORCE_IMPULSE, "body.impulse", "N s", QUERN_UPDATE, QUERN_VECTOR, .flags = QUERN_OPTIONAL | QUERN_RELEASED) \
	X(FORCE_TWIST, "body.twist", "N m s", QUERN_UPDATE, QUERN_AXIAL, .flags = QUERN_OPTIONAL | QUERN_RELEASED) \
	X(FORCE_WORK, "body.work", "J", QUERN_UPDATE, QUERN_SCALAR, .flags = QUERN_OPTIONAL | QUERN_RELEASED) \
	X(FORCE_SUPPORT, "total.support", "N s", QUERN_UPDATE, QUERN_VECTOR, .flags = QUERN_OPTIONAL | QUERN_RELEASED, \
		.doc = "Impulse that fixed grains have given to moving ones.") \
	X(FORCE_DAMPED, ENERGY_USE("damped", QUERN_UPDATE, "Lost in dashpots so far.")) \
	X(FORCE_RUBBED, ENERGY_USE("rubbed", QUERN_UPDATE, "Lost to sliding so far, and to yielding and to new bridges of liquid where a law has these.")) \
	X(FORCE_TREMBLING, "total.trembling", "1", QUERN_UPDATE, QUERN_INDEX, \
		.doc = "Steps that turned the grains' velocities back, less those that did not; never below 0.") \
	X(FORCE_DEEP_FIRST, "total.deep_first", "1", QUERN_UPDATE, QUERN_SCALAR, .when = "overlap.most", .initial = -1, \
		.doc = "Id of the grain whose deep contact is watched; -1: none is.") \
	X(FORCE_DEEP_SECOND, "total.deep_second", "1", QUERN_UPDATE, QUERN_SCALAR, .when = "overlap.most", \
		.doc = "Id of its partner; -1 - k for body k.") \
	X(FORCE_DEEP_TIME, "total.deep_time", "s", QUERN_UPDATE, QUERN_SCALAR, .when = "overlap.most", \
		.doc = "For how long the contact has been deep.") \
	BOX_LISTED_ROWS(X, FORCE_BOX, QUERN_READ) \
	X(FORCE_BOX_WORK, "total.box_work", "J", QUERN_UPDATE, QUERN_SCALAR, .when = "boxed") \
	X(FORCE_BOX_LOAD, "total.box_load", "J", QUERN_UPDATE, QUERN_VECTOR, .when = "boxed")
QUERN_USE_ENUM_FROM(LOOK_USES_ROWS, MOVE_USES);

#define ENERGY_USES(X) \
	X(OBSERVE_KINETIC, \
		ENERGY_USE("kinetic", QUERN_WRITE, "Of the grains, with the velocity in the middle of a kick.")) \
	X(OBSERVE_POTENTIAL, ENERGY_USE("potential", QUERN_WRITE, "Of the grains, -m g x.")) \
	X(OBSERVE_STORED, ENERGY_USE("stored", QUERN_WRITE, "In normal springs.")) \
	X(OBSERVE_SHEARED, ENERGY_USE("sheared", QUERN_WRITE, "In tangential springs."))
QUERN_USE_ENUM_FROM(LOOK_USES_ROWS, ENERGY_USES);

#define FORCE_USES(X) STATE_USES(X, QUERN_UPDATE, QUERN_WRITE) MOVE_USES(X)
#define OBSERVE_USES(X) LOOK_USES(X) ENERGY_USES(X)
/* clang-format on */
