/* SPDX-License-Identifier: MIT */
/* Checkpoints: what comes back is all that is looked at next, forged values are refused, and memory is taken once. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <checkpoint.h>
#include <frame.h>
#include <h5.h>
#include <harness.h>
#include <math.h>
#include <observe.h>
#include <sidecar.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static char place[64];

static int open_place(void **state) {
	(void)state;
	snprintf(place, sizeof place, "%s/quern-XXXXXX", access("/dev/shm", W_OK) ? "/tmp" : "/dev/shm");
	return mkdtemp(place) ? 0 : -1;
}

static int close_place(void **state) {
	char *command = quern_format("rm -r '%s'", place);
	(void)state;
	const int status = system(command);
	free(command);
	return status;
}

static const char heap[] =
	"quern: 1\ndimension: 2\nseed: 5\ngravity: [0, -9.81]\ndomain: {lower: [0, 0], upper: [0.012, 0.03]}\n"
	"time: {end: 0.004}\noutput: {every: 0.001, compress: false, fields: [contact.force, grain.force]}\n"
	"bodies:\n- plane: {point: [0, 0], normal: [0, 1]}\n- plane: {point: [0, 0], normal: [1, 0]}\n"
	"- plane: {point: [0.012, 0], normal: [-1, 0]}\n"
	"grains:\n  material: {density: 2500, radius: {mean: 0.001, spread: 0.2}}\n"
	"  contact: {linear: {stiffness: 1e5, friction: 0.4}}\n  integrator: velocity_verlet\n"
	"  fill: {region: {box: {lower: [0.001, 0.001], upper: [0.011, 0.012]}}, settle: true}\n"
	"  settle: {energy: 0.05}\nobserve: [energy, momentum, {wall_force: {body: 0}}]\n";

static quern_run *open_heap(void) {
	quern_run *run = harness_open(1, "%s", heap);
	run->folder = quern_copy(place);
	return run;
}

static quern_status read_back(quern_run *run, quern_text *why) {
	char *path = quern_format("%s/checkpoint.h5", place);
	quern_text said = { 0 };
	int64_t rows;
	const quern_status status = quern_checkpoint_read(run, path, false, &rows, &said, why);
	assert_int_equal(said.length, 0);
	quern_text_finish(&said);
	free(path);
	return status;
}

/* ---- between settling and release ---- */

typedef struct {
	quern_series series;
	char *frame;
	size_t size;
} output;

/* The first frame and the first row, as the run would write them now. */
static output first_output(quern_run *run) {
	output out = { .size = 0 };
	char *frames = quern_format("%s/frames", place), *path = quern_format("%s/000000.h5", frames), why[256];
	mkdir(frames, 0777);
	run->sidecars = quern_sidecars_create(place, 0, why);
	assert_non_null(run->sidecars);
	assert_int_equal(quern_series_init(&out.series, run, 0), QUERN_OK);
	quern_run_frame(run);
	harness_look(run);
	assert_int_equal(quern_series_add(&out.series, run), QUERN_OK);
	assert_int_equal(quern_frame_write(run, 0), QUERN_OK);
	quern_sidecars_destroy(run->sidecars);
	FILE *file = fopen(path, "rb");
	assert_non_null(file);
	out.frame = malloc(1 << 20);
	assert_non_null(out.frame);
	out.size = fread(out.frame, 1, 1 << 20, file);
	fclose(file);
	free(frames);
	free(path);
	return out;
}

static void output_finish(output *out) {
	quern_series_finish(&out->series);
	free(out->frame);
}

/* Settled, and no frame written yet: the first one is the same. */
static void settled_and_not_released(void **state) {
	(void)state;
	quern_text why = { 0 };
	quern_run *run = open_heap(), *again = open_heap();
	harness_settle(run);
	assert_true(run->clock.settled == 1 && run->clock.frame == -1 && run->clock.settle_step > 100);
	assert_int_equal(quern_checkpoint_write(run, 0), QUERN_OK);
	assert_int_equal(read_back(again, &why), QUERN_OK);
	assert_int_equal(again->clock.settle_step, run->clock.settle_step);
	output one = first_output(run), two = first_output(again);
	double sum = 0;
	for (size_t c = 0; c < one.series.n; c++) {
		assert_true(one.series.column[c].last == two.series.column[c].last);
		if (!strcmp(one.series.column[c].name, "energy.stored")) sum = one.series.column[c].last;
	}
	assert_true(sum > 0);
	assert_int_equal(one.size, two.size);
	assert_memory_equal(one.frame, two.frame, one.size);
	output_finish(&one);
	output_finish(&two);
	harness_close(run);
	harness_close(again);
}

/* ---- forged values ---- */

static char *good;
static size_t good_size;

static void load_good(void) {
	char *path = quern_format("%s/checkpoint.h5", place);
	FILE *file = fopen(path, "rb");
	assert_non_null(file);
	good = realloc(good, 1 << 22);
	assert_non_null(good);
	good_size = fread(good, 1, 1 << 22, file);
	fclose(file);
	free(path);
}

/* One attribute of the file, or the first value of one dataset, replaced in a copy whose checksum holds. */
static void forge(const char *name, double number, int64_t integer) {
	char *path = quern_format("%s/checkpoint.h5", place), why[256];
	assert_true(quern_save_bytes(path, good, good_size, why));
	const hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
	assert_true(file >= 0);
	const bool attribute = name[0] == '@';
	const hid_t at = attribute ? H5Aopen(file, name + 1, H5P_DEFAULT) : H5Dopen2(file, name, H5P_DEFAULT);
	assert_true(at >= 0);
	const hid_t type = attribute ? H5Aget_type(at) : H5Dget_type(at);
	const bool real = H5Tget_class(type) == H5T_FLOAT;
	if (attribute)
		H5Awrite(at, real ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT64, real ? (void *)&number : (void *)&integer);
	else {
		const hsize_t one = 1, zero = 0;
		const hid_t space = H5Dget_space(at), memory = H5Screate_simple(1, &one, NULL);
		H5Sselect_hyperslab(space, H5S_SELECT_SET, &zero, NULL, &one, NULL);
		H5Dwrite(at, real ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT64, memory, space, H5P_DEFAULT,
			real ? (void *)&number : (void *)&integer);
		H5Sclose(space);
		H5Sclose(memory);
	}
	H5Tclose(type);
	if (attribute) H5Aclose(at);
	else H5Dclose(at);
	H5Fclose(file);
	FILE *bytes = fopen(path, "rb+");
	assert_non_null(bytes);
	char *image = malloc(1 << 22);
	assert_non_null(image);
	const size_t size = fread(image, 1, 1 << 22, bytes);
	fclose(bytes);
	quern_h5_seal(image, size);
	assert_true(quern_save_bytes(path, image, size, why));
	free(image);
	free(path);
}

static const struct {
	const char *name;
	double number;
	int64_t integer;
	bool taken;
} forged[] = {
	{ "grain/position.0", 1e15, 0, false },
	{ "grain/position.1", -1e300, 0, false },
	{ "grain/position.0", 1, 0, false }, /* eighty domains away */
	{ "grain/position.0", (double)NAN, 0, false },
	{ "grain/radius.0", 180, 0, false }, /* every cell that it covers would be looked at */
	{ "grain/radius.0", -0.001, 0, false },
	{ "grain/velocity.0", (double)INFINITY, 0, false },
	{ "total/damped.0", (double)INFINITY, 0, false },
	{ "total/rubbed.0", (double)NAN, 0, false },
	{ "total/displacement.0", (double)INFINITY, 0, true }, /* that is what a stale list has */
	{ "total/displacement.0", (double)NAN, 0, false },
	{ "grain/acceleration.0", (double)NAN, 0, true }, /* of a grain that has never been pushed */
	{ "grain/acceleration.0", (double)INFINITY, 0, false },
	{ "grain/id.0", 0, -1, false },
	{ "grain/id.0", 0, 1 << 20, false },
	{ "contact/first.0", 0, -1, false },
	{ "contact/second.0", 0, 1 << 30, false },
	{ "@steps_in", 0, 1000000000, false },
	{ "@steps_in", 0, 0, false },
	{ "@at", 0, -1, false },
	{ "@at", 0, 1 << 20, false },
	{ "@step", 0, -1, false },
	{ "@step", 0, INT64_MAX, false },
	{ "@settle_step", 0, INT64_MIN, false },
	{ "@frame", 0, 7, false },
	{ "@frame", 0, -2, false },
	{ "@settled", 0, 0, false },
	{ "@settled", 0, 2, false },
	{ "@rows", 0, 9, false },
	{ "@dt", 1, 0, false },
	{ "@dt", -1e-6, 0, false },
	{ "@end", 1e300, 0, false },
	{ "@begin", (double)NAN, 0, false },
	{ "@wall", (double)INFINITY, 0, false },
	{ "@processor", -1, 0, false },
	{ "@settle_processor", (double)NAN, 0, false },
	{ "@mass_initial", (double)NAN, 0, false },
	{ "@mass_initial", 1e9, 0, false },
	{ "grain/mass.0", 1e9, 0, false },
};

static void refuses_what_cannot_be(void **state) {
	(void)state;
	quern_run *run = open_heap();
	harness_steps(run, 3);
	assert_int_equal(quern_checkpoint_write(run, 1), QUERN_OK);
	harness_close(run);
	load_good();
	for (size_t k = 0; k < sizeof forged / sizeof *forged; k++) {
		quern_text why = { 0 };
		quern_run *again = open_heap();
		forge(forged[k].name, forged[k].number, forged[k].integer);
		const quern_status status = read_back(again, &why);
		if ((status == QUERN_OK) != forged[k].taken)
			fail_msg("%s = %g or %lld is %s", forged[k].name, forged[k].number, (long long)forged[k].integer,
				status == QUERN_OK ? "taken" : quern_text_string(&why));
		assert_true(forged[k].taken || why.length > 10);
		quern_text_finish(&why);
		harness_close(again);
	}
	free(good);
}

/* State that no run could go on from is not written: the checkpoint from before stays. */
static void writes_only_what_can_be_read(void **state) {
	(void)state;
	quern_text why = { 0 };
	quern_run *run = open_heap(), *again = open_heap();
	harness_steps(run, 3);
	assert_int_equal(quern_checkpoint_write(run, 1), QUERN_OK);
	harness_field(run, "grain.velocity").real[0][2] = (double)NAN;
	assert_int_equal(quern_checkpoint_write(run, 1), QUERN_E_NUMERIC);
	assert_non_null(strstr(run->message, "grain.velocity"));
	assert_int_equal(read_back(again, &why), QUERN_OK);
	harness_close(run);
	harness_close(again);
}

/* ---- memory ---- */

/* sanitizers take memory of their own */
#if defined __SANITIZE_ADDRESS__ || defined __SANITIZE_THREAD__
#define SANITIZED
#elif defined __has_feature
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SANITIZED
#endif
#endif

#ifndef SANITIZED

static double peak(void) {
	struct rusage usage;
	getrusage(RUSAGE_SELF, &usage);
	return (double)usage.ru_maxrss * 1024;
}

enum { MANY = 1 << 19 };

/* In a process of its own, whose peak is that of one checkpoint alone. */
static int in_child(bool write) {
	const pid_t child = fork();
	if (child) {
		int status = -1;
		assert_true(child > 0 && waitpid(child, &status, 0) == child);
		return status;
	}
	quern_text why = { 0 };
	quern_run *run = open_heap();
	quern_store *store = &run->plan->store;
	const int grains = quern_store_set(store, "grain");
	if (write && quern_store_fill(store, grains, MANY) != QUERN_OK) _exit(2);
	for (int k = 0; write && k < (int)store->n_fields; k++) /* every page is there */
		if (store->fields[k].set == grains && !store->fields[k].local && store->fields[k].twice)
			for (int c = 0; c < store->fields[k].n_components; c++)
				memset(store->fields[k].data[1][c], 0, MANY * sizeof(double));
	const quern_field *radius = &store->fields[quern_store_field(store, "grain.radius")];
	for (uint32_t i = 0; write && i < MANY; i++) ((quern_real *)radius->data[radius->now][0])[i] = 0.001;
	run->mass_initial = quern_run_carries(run, "mass"); /* of all of them */
	const double before = peak();
	const quern_status status = write ? quern_checkpoint_write(run, 0) : read_back(run, &why);
	const double state = (double)quern_store_bytes(store), taken = peak() - before;
	print_message(
		"%s: %.0f MB of state, %.0f MB taken\n", write ? "writing" : "reading", state / 1e6, taken / 1e6);
	fflush(NULL);
	if (status != QUERN_OK) _exit(3);
	/* reading takes the state itself, and what HDF5 has for a few columns of it */
	_exit(taken > state + (write ? 0 : 8.0 * sizeof(quern_real) * MANY));
}

static void takes_memory_once(void **state) {
	(void)state;
	assert_int_equal(in_child(true), 0);
	assert_int_equal(in_child(false), 0);
}
#endif

int main(void) {
	quern_h5_begin();
	const struct CMUnitTest tests[] = { cmocka_unit_test(settled_and_not_released),
		cmocka_unit_test(refuses_what_cannot_be), cmocka_unit_test(writes_only_what_can_be_read),
#ifndef SANITIZED
		cmocka_unit_test(takes_memory_once)
#endif
	};
	return cmocka_run_group_tests(tests, open_place, close_place);
}
