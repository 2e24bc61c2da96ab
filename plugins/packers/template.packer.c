/* packer.my_name - grains on a lattice of squares or cubes, row by row from below.
 *
 * A packer fills one region. The job hands it one grain at a time, whose radius is drawn already, and knows where the
 * region ends and what is in the way; the packer's part is to find places. Random numbers come from the job's own stream,
 * host->random(stream, key, counter++, ...), so that every run gives the same grains. */
#include <quern/packer.h>

typedef struct {
	quern_real gap;
} lattice;

static const quern_param params[] = { QUERN_PARAM(lattice, gap, "1",
										  "Between neighbours, over the diameter of the first grain.",
										  .def = 0.05, .max = 100),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* Lattice lines that fit between the allowed centres; one at least. */
static uint32_t lines(const quern_pack_job *job, uint32_t axis, quern_real pitch) {
	const quern_real fit = (job->upper[axis] - job->lower[axis]) / pitch;
	return axis < job->dim ? (uint32_t)(fit < 0x1p20 ? fit : 0x1p20) + 1 : 1;
}

static void pack(const void *self, quern_pack_job *job) {
	const quern_real pitch = 2 * job->radius(job) * (1 + ((const lattice *)self)->gap) * (1 + 1e-9);
	const uint32_t n[3] = { lines(job, 0, pitch), lines(job, 1, pitch), lines(job, 2, pitch) };
	for (uint64_t k = 0; k < (uint64_t)n[0] * n[1] * n[2]; k++) {
		const uint64_t at[3] = { k % n[0], k / n[0] % n[1], k / n[0] / n[1] };
		quern_spot spot = { .radius = job->radius(job) };
		for (uint32_t a = 0; a < job->dim; a++) spot.x[a] = job->lower[a] + pitch * (quern_real)at[a];
		if (!job->inside(job, spot.x) || !job->free(job, &spot))
			continue; /* the grain waits for the next place */
		if (!job->place(job, &spot)) return;
	}
}

static const quern_packer_ops ops = { .size = sizeof ops, .pack = { pack, pack } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "packer.my_name",
	.brief = "Grains on a square or cubic lattice.",
	.instance_size = sizeof(lattice),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
