#include "sidecar.h"
#include "h5.h"
#include "text.h"
#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { MOST_SETS = 8, MOST_FIELDS = 48 };

typedef struct {
	char name[56];
	int columns;
	bool real, wide; /* 8-byte real, or integer of 8 or 4 bytes */
} field;

typedef struct {
	char name[24];
	size_t n;
	field field[MOST_FIELDS];
	int n_fields;
} set;

typedef struct {
	int64_t number;
	double time;
	set set[MOST_SETS];
	int n_sets;
} entry;

struct quern_sidecars {
	char *folder;
	entry *entries;
	size_t n, capacity;
};

/* ---- what a frame holds ---- */

static herr_t note_field(hid_t group, const char *name, const H5L_info_t *info, void *arg) {
	set *s = arg;
	size_t rows, columns;
	(void)info;
	if (s->n_fields == MOST_FIELDS || !quern_h5_read_size(group, name, &rows, &columns)) return 0;
	const hid_t data = H5Dopen2(group, name, H5P_DEFAULT), type = H5Dget_type(data);
	field *f = &s->field[s->n_fields++];
	snprintf(f->name, sizeof f->name, "%s", name);
	f->columns = (int)columns;
	f->real = H5Tget_class(type) == H5T_FLOAT;
	f->wide = H5Tget_size(type) == 8;
	s->n = rows;
	H5Tclose(type);
	H5Dclose(data);
	return 0;
}

static herr_t note_set(hid_t file, const char *name, const H5L_info_t *info, void *arg) {
	entry *e = arg;
	(void)info;
	const hid_t group = quern_h5_find(file, name);
	if (group < 0) return 0;
	if (e->n_sets < MOST_SETS) {
		set *s = &e->set[e->n_sets];
		*s = (set) { .n = 0 };
		snprintf(s->name, sizeof s->name, "%s", name);
		H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, NULL, note_field, s);
		e->n_sets += s->n_fields > 0;
	}
	H5Gclose(group);
	return 0;
}

static bool describe(const char *folder, int64_t number, entry *e) {
	char *path = quern_format("%s/frames/%06lld.h5", folder, (long long)number);
	const hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
	*e = (entry) { .number = number };
	free(path);
	if (file < 0) return false;
	const bool good = quern_h5_read_number(file, "time", &e->time);
	H5Literate(file, H5_INDEX_NAME, H5_ITER_INC, NULL, note_set, e);
	H5Fclose(file);
	return good;
}

static const field *position_of(const set *s) {
	for (int k = 0; k < s->n_fields; k++)
		if (!strcmp(s->field[k].name, "position")) return &s->field[k];
	return NULL;
}

/* ---- XDMF ---- */

static void data_item(quern_text *out, const entry *e, const set *s, const field *f) {
	quern_text_add(out, "<DataItem Dimensions=\"%zu", s->n);
	if (f->columns > 1) quern_text_add(out, " %d", f->columns);
	quern_text_add(out,
		"\" NumberType=\"%s\" Precision=\"%d\" Format=\"HDF\">frames/%06lld.h5:/%s/%s</DataItem>",
		f->real ? "Float" : "Int", f->wide ? 8 : 4, (long long)e->number, s->name, f->name);
}

/* Six columns stay a matrix: as "Tensor6" readers would reorder them. */
static const char *attribute_type(int columns) {
	return columns == 1 ? "Scalar" : columns == 3 ? "Vector" : columns == 9 ? "Tensor" : "Matrix";
}

static void xdmf_set(quern_text *out, const entry *e, const set *s) {
	const field *position = position_of(s);
	if (!position || !s->n) return;
	quern_text_add(out,
		"<Grid Name=\"%s\"><Topology TopologyType=\"Polyvertex\" NumberOfElements=\"%zu\" "
		"NodesPerElement=\"1\"><DataItem Dimensions=\"%zu\" NumberType=\"Int\" Precision=\"8\" "
		"Format=\"HDF\">"
		"views/%s_%06lld.hdf:/VTKHDF/Connectivity</DataItem></Topology>\n<Geometry GeometryType=\"XYZ\">",
		s->name, s->n, s->n, s->name, (long long)e->number);
	data_item(out, e, s, position);
	quern_text_add(out, "</Geometry>\n");
	for (int k = 0; k < s->n_fields; k++) {
		if (&s->field[k] == position) continue;
		quern_text_add(out, "<Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"Node\">", s->field[k].name,
			attribute_type(s->field[k].columns));
		data_item(out, e, s, &s->field[k]);
		quern_text_add(out, "</Attribute>\n");
	}
	quern_text_add(out, "</Grid>\n");
}

static bool write_xdmf(const quern_sidecars *q, char why[256]) {
	quern_text out = { 0 };
	quern_text_add(&out, "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\"><Domain>\n<Grid Name=\"run\" "
						 "GridType=\"Collection\" CollectionType=\"Temporal\">\n");
	for (size_t i = 0; i < q->n; i++) {
		const entry *e = &q->entries[i];
		quern_text_add(&out,
			"<Grid Name=\"frame\" GridType=\"Collection\" CollectionType=\"Spatial\"><Time "
			"Value=\"%.17g\"/>\n",
			e->time);
		for (int s = 0; s < e->n_sets; s++) xdmf_set(&out, e, &e->set[s]);
		quern_text_add(&out, "</Grid>\n");
	}
	quern_text_add(&out, "</Grid></Domain></Xdmf>\n");
	char *path = quern_format("%s/run.xdmf", q->folder);
	const bool good = quern_save_bytes(path, out.data, out.length, why);
	free(path);
	quern_text_finish(&out);
	return good;
}

/* ---- VTKHDF stubs, whose data are links into the frame ---- */

static void stub_list(quern_h5 *h, hid_t group, const char *name, hid_t type, size_t n, const void *data) {
	const hid_t written = quern_h5_write(h, group, name, type, n, 1, data);
	if (written >= 0) H5Dclose(written);
}

static void stub_topology(quern_h5 *h, hid_t group, size_t n) {
	int64_t *index = quern_take(n + 1, sizeof(int64_t));
	uint8_t *type = quern_take(n, 1);
	const int64_t count = (int64_t)n;
	for (size_t i = 0; i <= n; i++) index[i] = (int64_t)i;
	memset(type, 1, n); /* VTK_VERTEX */
	stub_list(h, group, "NumberOfPoints", H5T_NATIVE_INT64, 1, &count);
	stub_list(h, group, "NumberOfCells", H5T_NATIVE_INT64, 1, &count);
	stub_list(h, group, "NumberOfConnectivityIds", H5T_NATIVE_INT64, 1, &count);
	stub_list(h, group, "Connectivity", H5T_NATIVE_INT64, n, index);
	stub_list(h, group, "Offsets", H5T_NATIVE_INT64, n + 1, index);
	stub_list(h, group, "Types", H5T_NATIVE_UINT8, n, type);
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
	for (int k = 0; k < s->n_fields; k++) {
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

static const set *find_set(const entry *e, const char *name) {
	for (int k = 0; k < e->n_sets; k++)
		if (!strcmp(e->set[k].name, name)) return &e->set[k];
	return NULL;
}

static bool write_series(const quern_sidecars *q, const char *name, char why[256]) {
	json_t *files = json_array();
	for (size_t i = 0; i < q->n; i++) {
		const entry *e = &q->entries[i];
		const set *s = find_set(e, name);
		if (!s || !s->n || !position_of(s)) continue;
		char file[64];
		snprintf(file, sizeof file, "%s_%06lld.hdf", name, (long long)e->number);
		json_array_append_new(files, json_pack("{s:s, s:f}", "name", file, "time", e->time));
	}
	json_t *root = json_pack("{s:s, s:o}", "file-series-version", "1.0", "files", files);
	char *text = json_dumps(root, JSON_INDENT(1) | JSON_REAL_PRECISION(17));
	char *path = quern_format("%s/views/%s.hdf.series", q->folder, name);
	const bool good = text && quern_save_bytes(path, text, strlen(text), why);
	free(path);
	free(text);
	json_decref(root);
	return good;
}

/* ---- the whole ---- */

static void append(quern_sidecars *q, const entry *e) {
	q->entries = quern_grow(q->entries, q->n, &q->capacity, sizeof(entry));
	q->entries[q->n++] = *e;
}

quern_sidecars *quern_sidecars_create(const char *folder, int64_t frames) {
	quern_sidecars *q = quern_take(1, sizeof *q);
	q->folder = quern_copy(folder);
	char *views = quern_format("%s/views", folder);
	mkdir(views, 0777);
	free(views);
	entry *e = quern_take(1, sizeof *e);
	for (int64_t i = 0; i < frames; i++)
		if (describe(folder, i, e)) append(q, e);
	free(e);
	return q;
}

void quern_sidecars_destroy(quern_sidecars *q) {
	if (!q) return;
	free(q->folder);
	free(q->entries);
	free(q);
}

bool quern_sidecars_add(quern_sidecars *q, int64_t frame, char why[256]) {
	entry *e = quern_take(1, sizeof *e);
	bool good = describe(q->folder, frame, e);
	if (!good) snprintf(why, 256, "frame %lld cannot be read back", (long long)frame);
	else append(q, e);
	for (int s = 0; s < e->n_sets && good; s++) {
		if (!e->set[s].n || !position_of(&e->set[s])) continue;
		good = write_stub(q, e, &e->set[s], why) && write_series(q, e->set[s].name, why);
	}
	free(e);
	return good && write_xdmf(q, why);
}
