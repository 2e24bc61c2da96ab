/* SPDX-License-Identifier: MIT */
/* contact.marking - a law without force that has as many rows as a plugin may have, of every kind: it counts the steps of
 * a contact and writes down who touches. For tests. */
#include <quern/contact.h>

enum { AGE, NUMBER, STILL, FIRST_MARK, MARKS = QUERN_MOST_USES - FIRST_MARK };
typedef struct {
	int32_t unused;
} marking;
static const quern_param params[] = { QUERN_END_PARAMS };
#define MARK(k)                                                                                              \
	{                                                                                                        \
		.field = "contact.mark" #k, .unit = "1", .doc = "A number.", .access = QUERN_UPDATE,                 \
		.shape = QUERN_SCALAR, .initial = -(k)-1                                                             \
	}
static const quern_use uses[] = { { .field = "contact.age",
									  .unit = "1",
									  .doc = "Steps of the contact so far, -1 when apart.",
									  .access = QUERN_UPDATE,
									  .shape = QUERN_INDEX,
									  .initial = -1 },
	{ .field = "grain.id",
		.unit = "1",
		.doc = "Number of the grain.",
		.access = QUERN_READ,
		.shape = QUERN_ID,
		.flags = QUERN_OTHERS },
	{ .field = "grain.fixed",
		.unit = "1",
		.doc = "1: it does not move.",
		.access = QUERN_READ,
		.shape = QUERN_INDEX,
		.flags = QUERN_OTHERS | QUERN_OPTIONAL },
	MARK(0), MARK(1), MARK(2), MARK(3), MARK(4), MARK(5), MARK(6), MARK(7), MARK(8), MARK(9), MARK(10),
	MARK(11), MARK(12), MARK(13), MARK(14), MARK(15), MARK(16), MARK(17), MARK(18), MARK(19), MARK(20),
	MARK(21), MARK(22), MARK(23), MARK(24), MARK(25), MARK(26), MARK(27), MARK(28), QUERN_END_USES };
_Static_assert(sizeof uses / sizeof *uses == QUERN_MOST_USES + 1, "as many rows as there may be");

/* Mark k: 1000 times the first id plus the second plus k, and a million where the first is fixed, two where the second is. */
static void force(const void *self, const quern_contact_batch *b) {
	(void)self;
	const int32_t *fixed = b->use[STILL].index, *other = b->use_second[STILL].index;
	for (uint32_t i = 0; i < b->n; i++) {
		const bool touching = b->overlap[i] > 0;
		const quern_real pair = 1000.0 * (quern_real)b->use[NUMBER].id[i] +
								(quern_real)b->use_second[NUMBER].id[i] +
								(fixed ? 1e6 * fixed[i] + 2e6 * other[i] : 0);
		b->use[AGE].index[i] = touching ? b->use[AGE].index[i] + 1 : -1;
		for (int k = 0; k < MARKS; k++)
			b->use[FIRST_MARK + k].real[0][i] = touching ? pair + k : uses[FIRST_MARK + k].initial;
	}
}

static quern_real period(const void *self, uint32_t dim, quern_real mass, quern_real radius) {
	(void)self, (void)dim, (void)mass, (void)radius;
	return 1;
}

static const quern_contact_ops ops = { .size = sizeof ops, .force = { force, force }, .period = period };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "contact.marking",
	.brief = "Who touches, and for how long; for tests.",
	.instance_size = sizeof(marking),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
