/* SPDX-License-Identifier: MIT */
/* quern/contact.h - the kind `contact`: a law for pairs of grains, and what such laws share: restitution, first touch, the Coulomb cone.
 * docs/theory/contacts.md. One instance of a law, which is that of a pair of materials, and one dimension per batch. */
#pragma once
#include <quern/math.h>
#include <quern/vec.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The first of a pair is the grain of lower id, for ever; against a body it is the grain. Open pairs may be in a
 * batch (overlap <= 0): a law without reach gives them exactly zero force and sets its history to `initial`, by
 * select. A law with reach does so from there on, and keeps its history while a pair is apart by less; solvers forget
 * pairs that are beyond the reach of all laws. Weights, levers and torques b x f are the solver's; hence a law is
 * homogeneous of degree 1 in (stiffness, mass). */
typedef struct quern_contact_batch {
	uint32_t n, cap;
	quern_real dt;
	const quern_real *overlap;      /* m, r1 + r2 - distance */
	const quern_real *normal[3];    /* unit, from second to first */
	const quern_real *velocity[3];  /* m/s, of first relative to second at the contact, spin included */
	const quern_real *spin[3];      /* rad/s, first minus second; NULL unless grain.spin exists */
	const quern_real *turn[3];      /* rad/s, mean of first and second; 3-D with spin, else NULL */
	const quern_real *radius;       /* m, r1 r2/(r1 + r2) */
	const quern_real *mass;         /* kg, m1 m2/(m1 + m2), unweighted */
	const quern_column *use;        /* by row: contact.*: this batch's; grain.* READ: the first's */
	const quern_column *use_second; /* grain.* READ: the second's (against a body: the first's) */
	quern_real *force[3];           /* N on first; laws of a list ADD to it */
	/* N m on first, minus that on second; laws ADD to it. NULL unless a law of the list has a use of "contact.couple"
	 * (N m, QUERN_ADD, QUERN_AXIAL), which says that there are couples and no more. */
	quern_real *couple[3];
	/* NULL unless energy is observed: */
	quern_real *dashpot[3]; /* N on first, ADDed: the part of `force` that damps or clamps */
	quern_real *stored;     /* J, ADDed: in the normal spring */
	quern_real *sheared;    /* J, ADDed: in the tangential spring */
	/* J, ADDed: lost in this step other than by `dashpot`: to sliding, to yielding, and what springs give up where a pair has
	 * opened; of a pair of whose history a number is not as in a new one a law is asked once more, wherever it is by then */
	quern_real *rubbed;
	quern_real
		*drag_couple[3]; /* N m on first, ADDed: the part of `couple` that damps; NULL without couples too */
	/* m/s, rad/s; NULL unless the table says `means`: the mean of `velocity` and of `spin` over the time dt since the last
	 * evaluation, which is the way by which springs are stretched, and no other column may be taken for it: an integrator
	 * evaluates dashpots at the step's end (docs/theory/grains.md, section 3). With `means` 1 `turn` is such a mean too. */
	const quern_real *mean_velocity[3], *mean_spin[3];
	/* s^2: `velocity` and `spin` are late by `lag` times their second derivatives in time (quern_dashpot_share), the means are not;
	 * 0: neither is */
	quern_real lag;
	/* 1: `stored` and `sheared` are there, but what is added to them is not looked at */
	uint32_t losses_only, pad;
} quern_contact_batch;

typedef struct quern_contact_ops {
	/* follows 1: what it gives is bounded by the force of the laws before it in the list; a solver refuses such a law where
	 * none stands before it, since it would do nothing */
	uint32_t size, follows;
	void (*force[2])(const void *self, const quern_contact_batch *); /* [batch] [0] 2-D, [1] 3-D */
	/* [setup] s, half the shortest undamped period of a contact over all its modes: pi/omega */
	quern_real (*period)(const void *self, uint32_t dim, quern_real mass, quern_real radius);
	/* [setup] N/m, tangent normal stiffness at a normal force of `force` N */
	quern_real (*stiffness)(const void *self, uint32_t dim, quern_real radius, quern_real force);
	quern_real (*reach)(const void *self, quern_real radius); /* [setup] m beyond touching; NULL: 0 */
	/* [setup] damping ratio gamma/(2 sqrt(k m)) of the mode that is damped most, at the stiffness that `period` is of: an
	 * explicit dashpot has a limit of its own; NULL: 0 */
	quern_real (*damping)(const void *self, uint32_t dim);
	uint32_t means,
		pad; /* means 1: the law asks for mean_velocity and mean_spin; one with springs or a first touch does */
} quern_contact_ops;

QUERN_KIND(contact, quern_contact_ops, "A force between two grains in contact.",
	QUERN_EACH(quern_contact_ops, force), QUERN_OPTIONALLY(quern_contact_ops, period),
	QUERN_OPTIONALLY(quern_contact_ops, stiffness), QUERN_OPTIONALLY(quern_contact_ops, reach),
	QUERN_OPTIONALLY(quern_contact_ops, damping));

#ifdef __cplusplus
}
#endif

/* ==== what laws share ==== */

/* What of energies a batch asks for. */
enum { QUERN_NO_ENERGY, QUERN_LOSSES, QUERN_ALL_ENERGY };

/* Calls kernel(dim, rough, energy, self, b) with constants for `rough` and `energy`, so that each case gets a loop of its own. */
#define QUERN_CALL_LAW(kernel, dim, rough, self, b)                                                          \
	do {                                                                                                     \
		const quern_contact_batch *batch_ = (b);                                                             \
		const bool rough_ = (rough);                                                                         \
		if (batch_->stored && !batch_->losses_only) {                                                        \
			if (rough_) kernel(dim, true, QUERN_ALL_ENERGY, self, batch_);                                   \
			else kernel(dim, false, QUERN_ALL_ENERGY, self, batch_);                                         \
		} else if (batch_->stored) {                                                                         \
			if (rough_) kernel(dim, true, QUERN_LOSSES, self, batch_);                                       \
			else kernel(dim, false, QUERN_LOSSES, self, batch_);                                             \
		} else if (rough_) kernel(dim, true, QUERN_NO_ENERGY, self, batch_);                                 \
		else kernel(dim, false, QUERN_NO_ENERGY, self, batch_);                                              \
	} while (0)

/* Damping ratio zeta of a linear contact m x'' + 2 zeta w m x' + w^2 m x = 0 whose force is never attractive and which
 * rebounds with restitution e in (0, 1]: -ln e = 2 zeta F(zeta), F(zeta) = R_C(zeta^2, 1) (Schwager & Poeschel 2007,
 * in Carlson's form). The same zeta holds exactly for Hertz's force with a dashpot ~ overlap^(1/4). [setup] */
QUERN_INLINE quern_real quern_damping_ratio(quern_real e) {
	const quern_real wanted = -quern_log(e);
	quern_real low = 0, high = 64;
	for (int k = 0; k < 200 && wanted > 0; k++) { /* monotone: bisection down to neighbouring numbers */
		const quern_real z = 0.5 * (low + high);
		if (2 * z * quern_carlson_rc(z * z, 1) < wanted) low = z;
		else high = z;
	}
	return wanted > 0 ? 0.5 * (low + high) : 0;
}

/* A dashpot jumps at first touch, which would make any scheme first order. In the first two evaluations of a contact it is
 * weighted so that together they act for the time since touching. docs/theory/contacts.md, section 1 */
typedef struct quern_onset {
	quern_real
		time; /* s, that the pair has touched within this step: dt, or less in the first evaluation; 0 apart */
	quern_real weight; /* of the dashpot; 0 apart */
} quern_onset;

/* `approach` is the mean rate at which the overlap has grown over the step; `power` p of a dashpot ~ overlap^p: 0 linear, 1/4
 * Hertz. The weight is steep in an eighth of a step on both sides of where the first evaluation becomes the second, but does not
 * jump: else round-off would decide which of two it is. Least and largest of two numbers are what gcc makes vectors of. */
QUERN_INLINE quern_onset quern_first_touch(
	quern_real overlap, quern_real approach, quern_real dt, quern_real power) {
	const quern_real way = approach * dt, over = overlap > 0 ? overlap : 0, one_over = 1 / (1 + power);
	const quern_real of = way > 0.5 * over ? way : 0.5 * over;
	const quern_real steps = over / (of > 0 ? of : 1); /* since touching, 2 at most */
	const quern_real first = steps < 1 ? steps : 1, second = steps > 1 ? steps - 1 : 0;
	const quern_real in = 8 * first < 1 ? 8 * first : 1, out = 8 * second < 1 ? 8 * second : 1;
	return QUERN_VALUE(quern_onset, first * dt, 0.5 * in + one_over * first + (1 - (0.5 + one_over)) * out);
}

/* A velocity that is late by `lag` (quern_contact_batch) times its second derivative, which a spring of `stiffness` on `mass` makes
 * -stiffness/mass times the velocity itself, but for what the dashpot does: so the dashpot of that spring sees too much of it, and takes
 * this share of its coefficient, m/(m + lag k); 1 exactly where nothing is late. A tangential spring of grains that roll as it pushes them
 * acts on a third (discs) or 2/7 (spheres) of the pair's mass, or on all of it with 3 or 3.5 times the stiffness. docs/theory/contacts.md,
 * section 1 */
QUERN_INLINE quern_real quern_dashpot_share(quern_real stiffness, quern_real mass, quern_real lag) {
	return mass / (mass + lag * stiffness);
}

/* What the Coulomb cone leaves of an elastic force a and a dashpot's b: spring a + damper b, of size cap at most. */
typedef struct quern_cone {
	quern_real spring, damper; /* shares in [0, 1] */
} quern_cone;

/* Inside the cone both stay. Outside, the spring shrinks until |s a + b| = cap: to the largest such s, so that the
 * total keeps its side and changes smoothly. Where no s in [0, 1] brings it into the cone, the spring shrinks to
 * where the total is least, and both are clipped. All cases take the same one root and one division: a processor waits
 * longer for two than for all else here. Right for forces of 1e-50 to 1e50 N; below, friction vanishes. */
QUERN_INLINE quern_cone quern_cone_shares(quern_vec a, quern_vec b, quern_real cap) {
	const quern_vec sum = quern_vec_add(a, b), across = quern_vec_cross(a, b);
	const quern_real ab = quern_vec_dot(a, b, 3), aa = quern_vec_dot(a, a, 3), bb = quern_vec_dot(b, b, 3);
	const quern_real area = quern_vec_dot(across, across, 3), cc = cap * cap,
					 all = quern_vec_dot(sum, sum, 3);
	const quern_real q = cc - bb;
	/* the same number, since ab^2 + area = aa bb: of two terms of one sign, or as the sine of nearly opposite forces has it */
	const bool against = ab < 0;
	const quern_real inner = against ? aa * cc - area : ab * ab + aa * q;
	/* the total is least at s = 0, at s = 1 or, of aa |s a + b|^2 = area, between them; above 0: there it is within the cone */
	const bool between = against & (-ab < aa);
	const quern_real within = between ? inner : against ? cc - all : q;
	const quern_real least = between ? aa * area : against ? all : bb;
	const quern_real part = between ? -ab : against ? 1 : 0, whole = between ? aa : 1;
	const quern_real radicand = within > 0 ? inner : least,
					 root = __builtin_sqrt(radicand > 0 ? radicand : 0);
	const quern_real inside = ab > 0 ? ab + root : aa, below = within > 0 ? inside : root;
	const quern_real one_over = 1 / (below > 0 ? below : 1), clip = cap * one_over;
	const quern_real share = (ab > 0 ? q : root - ab) * one_over, kept = share < 1 ? share : 1;
	const quern_real cut = whole * clip, both = cut > 1 ? 1 : cut; /* that way round a NaN stays one */
	const bool slides = all > cc;
	return QUERN_VALUE(
		quern_cone, slides ? (within > 0 ? kept : part * clip) : 1, slides ? (within > 0 ? 1 : both) : 1);
}

/* The same along one line, a and b of either sign; returns what is left of a + b, and of a alone in *spring. */
QUERN_INLINE quern_real quern_cone_planar(quern_real a, quern_real b, quern_real cap, quern_real *spring) {
	const quern_real sum = a + b, up = sum > cap ? cap : sum, total = up < -cap ? -cap : up;
	const quern_real size = sum < 0 ? -sum : sum;
	const bool slides = sum != total, against = a * b < 0;
	const quern_real least = against ? a * a : cap * cap; /* what b must exceed for no spring to do */
	const quern_real clipped = against ? a * (cap / (size > 0 ? size : 1)) : 0;
	*spring = slides ? (b * b >= least ? clipped : total - b) : a;
	return total;
}

/* A tangential vector of the last step laid into the present tangent plane at its old length, after turning with the
 * pair by `angle` about n. */
QUERN_INLINE quern_vec quern_into_plane(quern_vec t, quern_vec n, quern_real angle) {
	const quern_vec turned = quern_vec_axpy(angle, quern_vec_cross(n, t), t);
	const quern_vec flat = quern_vec_axpy(-quern_vec_dot(turned, n, 3), n, turned);
	const quern_real was = quern_vec_dot(t, t, 3), is = quern_vec_dot(flat, flat, 3);
	return quern_vec_scale(is > 0 ? __builtin_sqrt(was / (is > 0 ? is : 1)) : 0, flat);
}

/* The same for the springs of a batch in three dimensions, in their place. A law does this before its own loop: where the root here and
 * that of the cone follow each other in one loop, a processor waits for both and does nothing else. A macro, since headers have no
 * QUERN_SIMD loops of their own, of which a compiler that is not told to make vectors would warn. */
#define QUERN_TURN_SPRINGS(spring, b)                                                                        \
	do {                                                                                                     \
		quern_real *const *springs_ = (spring);                                                              \
		const quern_contact_batch *batch_ = (b);                                                             \
		const quern_real dt_ = batch_->dt;                                                                   \
		QUERN_SIMD                                                                                           \
		for (uint32_t i_ = 0; i_ < batch_->n; i_++) {                                                        \
			const quern_vec n_ = QUERN_VEC_AT(batch_->normal, i_, 3),                                        \
							turn_ = QUERN_VEC_AT(batch_->turn, i_, 3);                                       \
			const quern_vec now_ =                                                                           \
				quern_into_plane(QUERN_VEC_AT(springs_, i_, 3), n_, quern_vec_dot(turn_, n_, 3) * dt_);      \
			QUERN_VEC_PUT(springs_, i_, now_, 3);                                                            \
		}                                                                                                    \
	} while (0)
