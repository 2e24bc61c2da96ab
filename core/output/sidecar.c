/* SPDX-License-Identifier: MIT */
#include "sidecar.h"
#include "child.h"
#include "h5.h"
#include "text.h"
#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct {
	char *name;
	size_t columns;
	bool real, wide; /* 8-byte real, or integer of 8 or 4 bytes */
} field;

typedef struct {
	char *name;
	size_t n, n_fields, capacity;
	field *field;
} set;

/* What a frame holds. */
typedef struct {
	int64_t number;
	double time;
	set *set;
	size_t n_sets, capacity;
} entry;

/* A file that names frames one after the other; `closing` stands behind the last one, and what comes next in its place. */
typedef struct {
	char *path, *set; /* set NULL: of all sets, in XDMF; else of one, in JSON */
	const char *opening, *closing;
	size_t tail; /* where `closing` begins; 0: there is no file yet */
	int64_t n;
	quern_text gathered; /* entries that wait for the file to be made */
} listing;

struct quern_sidecars {
	char *folder;
	listing *listing; /* run.xdmf first */
	size_t n, capacity;
};

/* ---- what a frame holds ---- */

static void entry_finish(entry *e) {
	for (size_t s = 0; s < e->n_sets; s++) {
		for (size_t k = 0; k < e->set[s].n_fields; k++) free(e->set[s].field[k].name);
		free(e->set[s].field);
		free(e->set[s].name);
	}
	free(e->set);
}

/* Names stand in XML, in JSON and in paths as they are. */
static bool is_plain(const char *name) {
	for (const char *c = name; *c; c++)
		if (!isalnum((unsigned char)*c) && !strchr("_-.", *c)) return false;
	return *name && *name != '.';
}

static herr_t note_field(hid_t group, const char *name, const H5L_info_t *info, void *arg) {
	set *s = arg;
	size_t rows, columns;
	(void)info;
	if (!is_plain(name) || !quern_h5_read_size(group, name, &rows, &columns)) return 0;
	const hid_t data = H5Dopen2(group, name, H5P_DEFAULT), type = H5Dget_type(data);
	s->field = quern_grow(s->field, s->n_fields, &s->capacity, sizeof(field));
	s->field[s->n_fields++] =
		(field) { quern_copy(name), columns, H5Tget_class(type) == H5T_FLOAT, H5Tget_size(type) == 8 };
	s->n = rows;
	H5Tclose(type);
	H5Dclose(data);
	return 0;
}

static herr_t note_set(hid_t file, const char *name, const H5L_info_t *info, void *arg) {
	entry *e = arg;
	(void)info;
	const hid_t group = is_plain(name) ? quern_h5_find(file, name) : -1;
	if (group < 0) return 0;
	e->set = quern_grow(e->set, e->n_sets, &e->capacity, sizeof(set));
	set *s = &e->set[e->n_sets++];
	*s = (set) { .name = quern_copy(name) };
	H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, NULL, note_field, s);
	H5Gclose(group);
	return 0;
}

static bool describe(const char *folder, int64_t number, entry *e) {
	char *path = quern_format("%s/frames/%06lld.h5", folder, (long long)number);
	const hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
	*e = (entry) { .number = number };
	free(path);
	if (file < 0) return false;
	const bool good = quern_h5_read_number(file, "time", &e->time) && isfinite(e->time);
	H5Literate(file, H5_INDEX_NAME, H5_ITER_INC, NULL, note_set, e);
	H5Fclose(file);
	return good;
}

static const field *position_of(const set *s) {
	for (size_t k = 0; k < s->n_fields; k++)
		if (!strcmp(s->field[k].name, "position")) return &s->field[k];
	return NULL;
}

static bool is_drawn(const set *s) { return s->n && position_of(s); }

/* ---- damage ---- */

typedef struct {
	const char *folder;
	int64_t first, frames;
	volatile int64_t *at; /* the one that is being read, for who comes after a crash */
} reading;

/* What the library prints as it crashes is nobody's sentence. */
static void try_reading(void *arg) {
	const reading *r = arg;
	if (!freopen("/dev/null", "w", stderr)) return;
	for (*r->at = r->first; *r->at < r->frames; ++*r->at) {
		entry e;
		describe(r->folder, *r->at, &e);
		entry_finish(&e);
	}
}

/* Frames have no checksum, and a damaged one can crash the library that reads it. A child reads them first: from `first`
 * on, all that it gets past can be read. */
static int64_t first_that_crashes(const char *folder, int64_t first, int64_t frames) {
	enum { SECONDS = 3600 };
	reading r = { folder, first, frames, quern_shared_take(sizeof(int64_t)) };
	if (!r.at) return frames;
	*r.at = first;
	const quern_child how = quern_child_run(try_reading, &r, SECONDS);
	const bool crashed = how.end == QUERN_CHILD_CRASHED || how.end == QUERN_CHILD_LATE;
	const int64_t at = crashed ? *r.at : frames;
	quern_shared_drop((void *)(uintptr_t)r.at, sizeof(int64_t));
	return at;
}

/* ---- an entry of run.xdmf ---- */

static const char xdmf_opening[] =
	"<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\"><Domain>\n<Grid Name=\"run\" "
	"GridType=\"Collection\" CollectionType=\"Temporal\">\n";
static const char xdmf_closing[] = "</Grid></Domain></Xdmf>\n";

static void data_item(quern_text *out, const entry *e, const set *s, const field *f) {
	quern_text_add(out, "<DataItem Dimensions=\"%zu", s->n);
	if (f->columns > 1) quern_text_add(out, " %zu", f->columns);
	quern_text_add(out,
		"\" NumberType=\"%s\" Precision=\"%d\" Format=\"HDF\">frames/%06lld.h5:/%s/%s</DataItem>",
		f->real ? "Float" : "Int", f->wide ? 8 : 4, (long long)e->number, s->name, f->name);
}

/* Six columns stay a matrix: as "Tensor6" readers would reorder them. */
static const char *attribute_type(size_t columns) {
	return columns == 1 ? "Scalar" : columns == 3 ? "Vector" : columns == 9 ? "Tensor" : "Matrix";
}

static void xdmf_set(quern_text *out, const entry *e, const set *s) {
	const field *position = position_of(s);
	quern_text_add(out,
		"<Grid Name=\"%s\"><Topology TopologyType=\"Polyvertex\" NumberOfElements=\"%zu\" "
		"NodesPerElement=\"1\"><DataItem Dimensions=\"%zu\" NumberType=\"Int\" Precision=\"8\" "
		"Format=\"HDF\">"
		"views/%s_%06lld.hdf:/VTKHDF/Connectivity</DataItem></Topology>\n<Geometry GeometryType=\"XYZ\">",
		s->name, s->n, s->n, s->name, (long long)e->number);
	data_item(out, e, s, position);
	quern_text_add(out, "</Geometry>\n");
	for (size_t k = 0; k < s->n_fields; k++) {
		if (&s->field[k] == position) continue;
		quern_text_add(out, "<Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"Node\">", s->field[k].name,
			attribute_type(s->field[k].columns));
		data_item(out, e, s, &s->field[k]);
		quern_text_add(out, "</Attribute>\n");
	}
	quern_text_add(out, "</Grid>\n");
}

static void xdmf_entry(quern_text *out, const entry *e) {
	quern_text_add(out,
		"<Grid Name=\"frame\" GridType=\"Collection\" CollectionType=\"Spatial\"><Time "
		"Value=\"%.17g\"/>\n",
		e->time);
	for (size_t s = 0; s < e->n_sets; s++)
		if (is_drawn(&e->set[s])) xdmf_set(out, e, &e->set[s]);
	quern_text_add(out, "</Grid>\n");
}

/* ---- VTKHDF stubs, whose data are links into the frame ---- */

static void stub_topology(quern_h5 *h, hid_t group, size_t n) {
	int64_t *index = quern_take(n + 1, sizeof(int64_t));
	uint8_t *type = quern_take(n, 1);
	const int64_t count = (int64_t)n;
	for (size_t i = 0; i <= n; i++) index[i] = (int64_t)i;
	memset(type, 1, n); /* VTK_VERTEX */
	quern_h5_put(h, group, "NumberOfPoints", H5T_NATIVE_INT64, 1, 1, &count);
	quern_h5_put(h, group, "NumberOfCells", H5T_NATIVE_INT64, 1, 1, &count);
	quern_h5_put(h, group, "NumberOfConnectivityIds", H5T_NATIVE_INT64, 1, 1, &count);
	quern_h5_put(h, group, "Connectivity", H5T_NATIVE_INT64, n, 1, index);
	quern_h5_put(h, group, "Offsets", H5T_NATIVE_INT64, n + 1, 1, index);
	quern_h5_put(h, group, "Types", H5T_NATIVE_UINT8, n, 1, type);
	free(index);
	free(type);
}

static void stub_attributes(quern_h5 *h, hid_t group) {
	const int64_t version[2] = { 1, 0 };
	const hsize_t two = 2;
	const hid_t space = H5Screate_simple(1, &two, NULL), type = H5Tcopy(H5T_C_S1);
	hid_t a = H5Acreate2(group, "Version", H5T_NATIVE_INT64, space, H5P_DEFAULT, H5P_DEFAULT);
	if (a < 0 || H5Awrite(a, H5T_NATIVE_INT64, version) < 0) h->failed = true;
	H5Aclose(a);
	H5Sclose(space);
	H5Tset_size(type, 16); /* readers want a fixed length, without a terminating zero */
	H5Tset_strpad(type, H5T_STR_NULLPAD);
	const hid_t scalar = H5Screate(H5S_SCALAR);
	a = H5Acreate2(group, "Type", type, scalar, H5P_DEFAULT, H5P_DEFAULT);
	if (a < 0 || H5Awrite(a, type, "UnstructuredGrid") < 0) h->failed = true;
	H5Aclose(a);
	H5Sclose(scalar);
	H5Tclose(type);
}

static bool write_stub(const quern_sidecars *q, const entry *e, const set *s, char why[256]) {
	quern_h5 h;
	if (!quern_h5_create(&h, true, 0)) return snprintf(why, 256, "out of memory"), false;
	char *native = quern_format("../frames/%06lld.h5", (long long)e->number);
	const hid_t group = quern_h5_group(&h, h.file, "VTKHDF"), data = quern_h5_group(&h, group, "PointData");
	stub_attributes(&h, group);
	stub_topology(&h, group, s->n);
	for (size_t k = 0; k < s->n_fields; k++) {
		const bool position = !strcmp(s->field[k].name, "position");
		char *target = quern_format("/%s/%s", s->name, s->field[k].name);
		if (H5Lcreate_external(native, target, position ? group : data,
				position ? "Points" : s->field[k].name, H5P_DEFAULT, H5P_DEFAULT) < 0)
			h.failed = true;
		free(target);
	}
	H5Gclose(data);
	H5Gclose(group);
	char *path = quern_format("%s/views/%s_%06lld.hdf", q->folder, s->name, (long long)e->number);
	const bool good = quern_h5_save(&h, path, why);
	free(path);
	free(native);
	return good;
}

/* ---- lists of frames ---- */

static listing *add_listing(quern_sidecars *q, char *path, const char *set_name) {
	q->listing = quern_grow(q->listing, q->n, &q->capacity, sizeof(listing));
	q->listing[q->n] = (listing) { .path = path, .opening = xdmf_opening, .closing = xdmf_closing };
	listing *l = &q->listing[q->n++];
	if (!set_name) return l;
	l->set = quern_copy(set_name);
	l->opening = "{\n \"file-series-version\": \"1.0\",\n \"files\": [";
	l->closing = "\n ]\n}\n";
	return l;
}

static listing *listing_of(quern_sidecars *q, const char *set_name) {
	for (size_t i = 1; i < q->n; i++)
		if (!strcmp(q->listing[i].set, set_name)) return &q->listing[i];
	return add_listing(q, quern_format("%s/views/%s.hdf.series", q->folder, set_name), set_name);
}

static bool write_at(int fd, const char *text, size_t place) {
	for (size_t left = strlen(text); left;) {
		const ssize_t n = pwrite(fd, text, left, (off_t)place);
		if (n < 0 && errno == EINTR) continue;
		if (n <= 0) return false;
		text += n, place += (size_t)n, left -= (size_t)n;
	}
	return true;
}

/* Puts text where `closing` stands, and `closing` behind it; on a fault the list is as it was. */
static bool extend(listing *l, const quern_text *text, char why[256]) {
	char *grown = quern_format("%s%s", text->data, l->closing);
	const int fd = open(l->path, O_WRONLY | O_CLOEXEC);
	const bool good = fd >= 0 && write_at(fd, grown, l->tail);
	if (!good) snprintf(why, 256, "%.180s cannot be written: %s", l->path, strerror(errno));
	if (!good && fd >= 0 &&
		(!write_at(fd, l->closing, l->tail) || ftruncate(fd, (off_t)(l->tail + strlen(l->closing)))))
		snprintf(why, 256, "%.180s is left without its end: %s", l->path, strerror(errno));
	if (fd >= 0) close(fd);
	if (good) l->tail += text->length;
	free(grown);
	return good;
}

static bool make(listing *l, const quern_text *text, char why[256]) {
	char *whole = quern_format("%s%s%s", l->opening, quern_text_string(text), l->closing);
	const bool good = quern_save_bytes(l->path, whole, strlen(whole), why);
	if (good) l->tail = strlen(l->opening) + text->length;
	free(whole);
	return good;
}

/* The entries that have gathered go into the file. */
static bool flush_listing(listing *l, char why[256]) {
	if (!l->gathered.length) return true;
	const bool good = l->tail ? extend(l, &l->gathered, why) : make(l, &l->gathered, why);
	quern_text_finish(&l->gathered);
	return good;
}

static void gather(quern_sidecars *q, const entry *e) {
	xdmf_entry(&q->listing[0].gathered, e);
	for (size_t s = 0; s < e->n_sets; s++) {
		if (!is_drawn(&e->set[s])) continue;
		listing *l = listing_of(q, e->set[s].name);
		quern_text_add(&l->gathered, "%s\n  {\"name\": \"%s_%06lld.hdf\", \"time\": %.17g}", l->n ? "," : "",
			l->set, (long long)e->number, e->time);
		l->n++;
	}
}

/* All frames that there are, but those that cannot be read: `left_out` names these. */
static void gather_all(quern_sidecars *q, int64_t frames, quern_text *left_out) {
	int64_t bad = frames > 0 ? first_that_crashes(q->folder, 0, frames) : 0;
	for (int64_t i = 0; i < frames; i++) {
		entry e = { .number = i };
		if (i != bad && describe(q->folder, i, &e)) gather(q, &e);
		else quern_text_add(left_out, "%s%lld", left_out->length ? ", " : "", (long long)i);
		entry_finish(&e);
		if (i == bad) bad = first_that_crashes(q->folder, i + 1, frames);
	}
}

static bool flush(quern_sidecars *q, char why[256]) {
	for (size_t i = q->n; i-- > 0;) /* run.xdmf names what is in views/, so it comes last */
		if (!flush_listing(&q->listing[i], why)) return false;
	return true;
}

/* ---- the whole ---- */

quern_sidecars *quern_sidecars_create(const char *folder, int64_t frames, char why[256]) {
	quern_sidecars *q = quern_take(1, sizeof *q);
	q->folder = quern_copy(folder);
	char *views = quern_format("%s/views", folder);
	const bool made = !mkdir(views, 0777) || errno == EEXIST;
	if (!made) snprintf(why, 256, "the folder %.180s cannot be made: %s", views, strerror(errno));
	free(views);
	add_listing(q, quern_format("%s/run.xdmf", folder), NULL);
	quern_text left_out = { 0 };
	if (made) gather_all(q, frames, &left_out);
	const bool good = made && flush(q, why);
	if (good)
		snprintf(why, 256, left_out.length ? "run.xdmf leaves out frames that cannot be read: %.180s" : "%s",
			quern_text_string(&left_out));
	quern_text_finish(&left_out);
	if (good) return q;
	quern_sidecars_destroy(q);
	return NULL;
}

void quern_sidecars_destroy(quern_sidecars *q) {
	if (!q) return;
	for (size_t i = 0; i < q->n; i++) {
		free(q->listing[i].path);
		free(q->listing[i].set);
		quern_text_finish(&q->listing[i].gathered);
	}
	free(q->listing);
	free(q->folder);
	free(q);
}

bool quern_sidecars_add(quern_sidecars *q, int64_t frame, char why[256]) {
	entry e;
	bool good = describe(q->folder, frame, &e);
	if (!good) snprintf(why, 256, "frame %lld cannot be read back", (long long)frame);
	for (size_t s = 0; s < e.n_sets && good; s++)
		if (is_drawn(&e.set[s])) good = write_stub(q, &e, &e.set[s], why);
	if (good) {
		gather(q, &e);
		good = flush(q, why);
	}
	entry_finish(&e);
	return good;
}
