/* check.my_name - the conformance test of a kind of one's own, called by `quern check my_name.ANYTHING.so`.
 *
 * A kind is a name and a table of functions. They stand in a header that the solver, the plugins and this test
 * include; here the header's part is the first paragraph, for a kind whose plugins give a value at a place. Whoever
 * brings a kind also brings template.my_name.c, from which `quern new my_name NAME` makes a plugin: both are found
 * wherever plugins are. */
#include <math.h>
#include <quern/check.h>

typedef struct {
	uint32_t n, cap;
	const quern_real *place; /* m */
	quern_real *value;
} my_name_batch;

typedef struct {
	uint32_t size, pad;
	void (*value)(const void *self, const my_name_batch *); /* [batch] even: the same at -x */
} my_name_ops;
QUERN_KIND(my_name, my_name_ops, "A value at a place.", QUERN_ONE(my_name_ops, value));

enum { PLACE, VALUE };

/* From the columns of a batch to a call. */
static void call(const quern_check_kernel *k, const quern_check_batch *b) {
	const my_name_ops *ops = k->ops;
	const my_name_batch batch = { .n = b->n,
		.cap = b->cap,
		.place = quern_check_at(k, b, PLACE, 0),
		.value = quern_check_at(k, b, VALUE, 0) };
	ops->value(k->self, &batch);
}

/* A kernel on ordinary input. With it the program tries parameters, batches, threads and guards. */
static quern_check_kernel *make(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, uint32_t n) {
	if (variant) return NULL;
	quern_check_kernel *k = c->host->kernel_create(c, it, "value", n);
	k->call = call;
	c->host->add(k, PLACE, "place", QUERN_CHECK_IN, 1);
	c->host->add(k, VALUE, "value", QUERN_CHECK_OUT, 1);
	c->host->fill(k, PLACE, 1, 1, -1, 1);
	return k;
}

/* What must hold for this kind alone: a tally each. */
static void law(const quern_check *c) {
	enum { PLACES = 500 };
	quern_check_tally even = { .name = "the same on both sides" };
	for (uint32_t dim = 2; dim <= 3; dim++) {
		quern_check_instance *it = c->host->instance_create(c, dim, 0);
		if (!it) continue;
		quern_check_kernel *k = make(c, it, 0, PLACES), *other = make(c, it, 0, PLACES);
		for (uint32_t i = 0; i < PLACES; i++) quern_check_given(other, PLACE, 0)[i] *= -1;
		c->host->run(k, 64, false);
		c->host->run(other, 64, false);
		for (uint32_t i = 0; i < PLACES; i++) {
			const quern_real a = quern_check_found(k, VALUE, 0)[i], b = quern_check_found(other, VALUE, 0)[i];
			c->host->measure(&even, fabs(a - b), 1e-12 * fabs(a),
				"%u-D: at %.3g m there is %.9g, and %.9g opposite", dim, quern_check_given(k, PLACE, 0)[i], a,
				b);
		}
		c->host->kernel_destroy(k);
		c->host->kernel_destroy(other);
		c->host->instance_destroy(it);
	}
	c->host->tell(c, &even, NULL);
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = {
	.size = sizeof ops, .kind = &quern_my_name_kind, .make = make, .law = law
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.my_name",
	.brief = "Values: the same on both sides.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
