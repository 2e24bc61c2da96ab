/* SPDX-License-Identifier: MIT */
/* fuzz grains - any bytes as a table of grains; the first says whether of discs or of spheres */
#include <dem.h>
#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
	char why[200] = "";
	grain_table table = { 0 };
	if (!size) return 0;
	char *text = malloc(size); /* exactly as long as it says: a byte beyond is seen */
	for (size_t i = 1; i < size; i++) text[i - 1] = (char)data[i];
	static const dem_material two[] = { { .name = "sand" }, { .name = "steel" } };
	const dem d = { .dim = data[0] & 1 ? 3 : 2, .material = two, .n_materials = 2 };
	const bool good = quern_grain_table_read(text, size - 1, &d, &table, why);
	if (good ? !table.n : !*why) abort();
	for (uint32_t i = 0; i < table.n && good; i++) {
		if (!isfinite(table.grain[i].position[0]) || table.grain[i].radius <= 0) abort();
		if (table.grain[i].kind < 0 || table.grain[i].kind > 1) abort();
	}
	quern_grain_table_finish(&table);
	free(text);
	return 0;
}
