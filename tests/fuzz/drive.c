/* SPDX-License-Identifier: MIT */
/* fuzz drive - any bytes as a table of way points; the first says whether of two or of three dimensions */
#include <drive.h>
#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* What a walk relies on. */
static void look(const drive_path *p) {
	if (!p->n || p->n > DRIVE_MOST_LEGS) abort();
	for (uint32_t k = 0; k < p->n; k++) {
		if (!(p->leg[k].time > (k ? p->leg[k - 1].time : 0)) || !isfinite(p->leg[k].pressure)) abort();
		for (uint32_t c = 0; c < DRIVE_MOST_COMPONENTS; c++)
			if (!isfinite(p->leg[k].target[c])) abort();
	}
	bool alike = false;
	for (uint32_t c = 0; c < DRIVE_MOST_COMPONENTS; c++) {
		alike |= p->control[c] == DRIVE_ALIKE;
		if (!isfinite(p->start.target[c]) || (p->slide[c] && c < p->dim)) abort();
	}
	if (alike != p->pressed) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
	drive_path path;
	quern_text why = { 0 };
	if (!size) return 0;
	char *text = malloc(size); /* exactly as long as it says: a byte beyond is seen */
	for (size_t i = 1; i < size; i++) text[i - 1] = (char)data[i];
	if (quern_drive_table_read(text, size - 1, data[0] & 1 ? 3 : 2, 1e3, &path, &why)) look(&path);
	else if (!why.length) abort();
	quern_drive_path_finish(&path);
	quern_text_finish(&why);
	free(text);
	return 0;
}
