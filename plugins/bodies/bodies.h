/* bodies - what every body takes besides its own shape; the keys of a scene's `bodies` entries */
#pragma once
#include <math.h>
#include <quern/abi.h>

enum { BODY_ALWAYS, BODY_SETTLING, BODY_RUNNING };
enum { BOUNDARY_SLIP, BOUNDARY_STICKY, BOUNDARY_NONE };

typedef struct body_item {
	int32_t when;        /* BODY_* */
	int32_t boundary;    /* BOUNDARY_* on the continuum's grid */
	quern_real friction; /* of the boundary; NaN: the choice above holds */
} body_item;

QUERN_INLINE bool quern_body_is_there(const quern_bound *body, bool settling) {
	const int32_t when = ((const body_item *)body->item)->when;
	return when == BODY_ALWAYS || (when == BODY_SETTLING) == settling;
}
