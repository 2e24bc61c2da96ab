/* SPDX-License-Identifier: MIT */
#include "prospect.h"
#include "wishes.h"
#include <math.h>

double quern_prospect_ratio(
	double n, double substep_price, double step_price, double own_substep, double own_step, double alone) {
	const double longest = fmin(n * own_substep, own_step);
	return (n * substep_price + step_price) / longest / (alone / own_substep);
}

static const char *who_takes_substeps(const quern_run *run) {
	for (size_t i = 0; i < run->plan->scene->n_sections; i++) {
		const quern_section *section = &run->plan->scene->sections[i];
		for (const quern_set *set = section->ops->sets; set->name && quern_section_takes_substeps(section);
			 set++)
			if (set->counted) return set->plural ? set->plural : set->name;
	}
	return NULL;
}

/* A second long step, since what solvers hand to each other may take a first one to look at. */
enum { STEPS = 2 };
static const double patience = 30; /* s on one core, by the prices in the tables */

static bool try_steps(quern_run *run) {
	run->mute = true;
	run->clock.settled = 1;
	while (run->clock.step < STEPS) switch (quern_run_next(run)) {
		case QUERN_FRAME_IS_DUE: quern_run_frame(run); break;
		case QUERN_STEPPED: break;
		default: return false;
		}
	return true;
}

static double discrete_share(quern_run *run) {
	const quern_account sums = quern_run_account(run);
	return quern_account_of(&sums, "discrete") / quern_account_of(&sums, "mass");
}

quern_prospect quern_prospect_of(quern_run *run, const quern_estimate *before) {
	quern_prospect p = {
		.cell = quern_wish_cell(run->scene), .substeps = before->most_substeps, .who = who_takes_substeps(run)
	};
	const quern_own_steps *own = &before->own;
	if (!(discrete_share(run) > 1 - 1e-9)) return p;
	const double alone = quern_estimate_price(run, true, 1, 1), n = before->substeps;
	if (!p.who || !(p.substeps > 0) || !(alone > 0) || STEPS * n * alone > patience || !try_steps(run))
		return p;
	const double substep = quern_estimate_price(run, true, 1, 1);
	quern_own_steps wide = *own;
	wide.step *= 2; /* waves take as much longer through a cell */
	p.wide_substeps = quern_run_most_substeps(&wide);
	const double price[] = { quern_estimate_price(run, false, (uint32_t)n, 1),
		quern_estimate_price(run, false, (uint32_t)p.substeps, 1),
		quern_estimate_price(run, false, (uint32_t)p.wide_substeps, 2) };
	p.discrete = discrete_share(run);
	p.ratio = quern_prospect_ratio(n, substep, price[0], own->substep, fmin(own->step, before->step), alone);
	p.best = quern_prospect_ratio(p.substeps, substep, price[1], own->substep, own->step, alone);
	p.wide = quern_prospect_ratio(p.wide_substeps, substep, price[2], own->substep, wide.step, alone);
	p.known = true;
	return p;
}
