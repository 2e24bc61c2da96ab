/* neighbours.my_name - sweep and prune: grains sorted along one axis look along it until they are out of reach.
 *
 * The solver asks three things: a key for each grain, by which it sorts them; an index over the sorted grains; and, block
 * by block and in parallel, the pairs that are near. The cost here grows with the length of a column of grains across
 * the axis: best for long, thin flows. */
#include <math.h>
#include <quern/neighbours.h>

typedef struct {
	quern_real slab; /* from the scene */
} sweep;

static const quern_param params[] = { QUERN_PARAM(sweep, slab, "1",
										  "Length of a block along the axis, in largest diameters.", .def = 8,
										  .min = 1, .max = 1e6),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* Along the longest axis that is not periodic; 3 if there is none, and everybody looks at everybody. */
typedef struct {
	uint32_t axis;
	quern_real low, length;
} line;

static line line_of(const quern_neighbour_job *job) {
	line l = { .axis = 3, .length = 0 };
	for (uint32_t a = 0; a < job->dim; a++) {
		quern_real low = INFINITY, high = -INFINITY;
		for (uint32_t i = 0; i < job->n; i++) {
			low = job->position[a][i] < low ? job->position[a][i] : low;
			high = job->position[a][i] > high ? job->position[a][i] : high;
		}
		if (!job->periodic[a] && high - low >= l.length) l = (line) { a, low, high - low };
	}
	return l;
}

/* The block in the high half, the place inside it in the low one: together they rise along the axis. */
static size_t keys(const void *self, const quern_neighbour_job *job, uint64_t *key) {
	const line l = line_of(job);
	const quern_real wanted = ((const sweep *)self)->slab * 2 * job->largest;
	const quern_real slab = l.length / wanted > 1e6 ? l.length * 1e-6 : wanted;
	for (uint32_t i = 0; i < job->n; i++) {
		const quern_real t = l.axis < 3 ? (job->position[l.axis][i] - l.low) / slab : 0, block = floor(t);
		key[i] = (uint64_t)block << 32 | (uint64_t)((t - block) * 0x1p31);
	}
	return sizeof(line);
}

static void make_index(const void *self, const quern_neighbour_job *job) {
	(void)self;
	*(line *)job->memory = line_of(job);
}

static bool near(const quern_neighbour_job *job, uint32_t i, uint32_t k) {
	const quern_real reach = job->radius[i] + job->radius[k] + job->reach;
	quern_real d2 = 0;
	for (uint32_t a = 0; a < job->dim; a++) {
		const quern_real length = job->upper[a] - job->lower[a];
		quern_real d = job->position[a][i] - job->position[a][k];
		if (job->periodic[a]) d = d > 0.5 * length ? d - length : d < -0.5 * length ? d + length : d;
		d2 += d * d;
	}
	return d2 < reach * reach;
}

/* Forwards to all that follow; backwards to those of earlier blocks, which list the pair as well. */
static uint32_t pairs(
	const void *self, const quern_neighbour_job *job, uint32_t b, uint32_t cap, quern_pair *out) {
	const line *l = job->memory;
	const uint32_t begin = job->block[b], end = job->block[b + 1];
	/* keys are rounded, so that two grains may be out of order by that little */
	const quern_real farthest = 2 * job->largest + job->reach + 1e-6 * l->length;
	const quern_real *x = l->axis < 3 ? job->position[l->axis] : NULL;
	uint32_t n = 0;
	(void)self;
	for (uint32_t i = begin; i < end; i++)
		for (int way = 1; way >= -1; way -= 2) {
			const int64_t first = way > 0 ? (int64_t)i + 1 : (int64_t)begin - 1;
			for (int64_t k = first; k >= 0 && k < (int64_t)job->n; k += way) {
				if (x && way * (x[k] - x[i]) > farthest) break;
				if (!near(job, i, (uint32_t)k)) continue;
				if (n < cap) out[n] = (quern_pair) { (int32_t)i, (int32_t)k };
				n++;
			}
		}
	return n;
}

static const quern_neighbour_ops ops = {
	.size = sizeof ops, .keys = keys, .index = make_index, .pairs = pairs
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "neighbours.my_name",
	.brief = "Sweep and prune along the longest axis.",
	.instance_size = sizeof(sweep),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
