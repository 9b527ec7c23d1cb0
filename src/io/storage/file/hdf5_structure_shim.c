/* SPDX-License-Identifier: MIT */
/* Permitted structure of an HDF5 file that RockDDA opens: groups, each with one path, and in them plain datasets and
 * attributes of numbers and texts in the file itself. All other features of HDF5 can lead out of the file (external
 * storage, external links, virtual datasets), load external code (filters, user-defined links), never end (groups that
 * contain each other) or need unlimited memory, and RockDDA writes none of them. Checked right after opening, before
 * anything is read or written. The Python package has the same rules (postprocess/rockdda/storage/structure.py). */
#define _GNU_SOURCE
#include <hdf5.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if H5_VERSION_GE(1, 12, 0)
typedef H5L_info1_t link_info_t;
typedef H5O_info1_t object_info_t;
#define GET_OBJECT_INFO H5Oget_info1
#define VISIT_LINKS H5Literate1
#else
typedef H5L_info_t link_info_t;
typedef H5O_info_t object_info_t;
#define GET_OBJECT_INFO H5Oget_info
#define VISIT_LINKS H5Literate
#endif

/* Groups in groups at most; attributes of an object, and their bytes; bytes of a chunk. */
enum { DEEPEST = 8, MOST_ATTRIBUTES = 1000, MOST_VALUES = 1000000, LARGEST_CHUNK = 1 << 26 };

/* Deflate packs at most 1032 bytes into one. What is stored is added up, which takes time in large files, only for a
 * data set of more bytes than this, and than this multiple of the file. */
static const double best_compression = 1032, small = 1 << 26, usual_compression = 16;

typedef struct {
   char *message; /* the problem, zero-terminated */
   size_t room;
   char path[1024];
   size_t length; /* of the path */
   int depth;
   hsize_t file_size;
   uint64_t *seen; /* addresses of the visited objects, open addressing; 0: free */
   size_t n, size;
} check_t;

/* Keep the first problem. Returns -1. */
static int refuse(check_t *check, const char *what)
{
   if (check->message[0] == '\0')
      snprintf(check->message, check->room, "%s %s", check->length > 0 ? check->path : "/", what);
   return -1;
}

/* Record an address. 1: already recorded; 0: new; -1: no memory. */
static int note_address(check_t *check, uint64_t address)
{
   uint64_t key = address + 1;
   size_t i;
   if (2 * check->n >= check->size) {
      size_t size = check->size ? 4 * check->size : 256, k;
      uint64_t *larger = calloc(size, sizeof *larger);
      if (!larger) return -1;
      for (k = 0; k < check->size; k++) {
         if (check->seen[k] == 0) continue;
         for (i = (size_t)(check->seen[k] * 0x9e3779b97f4a7c15u >> 20) % size; larger[i] != 0;) i = (i + 1) % size;
         larger[i] = check->seen[k];
      }
      free(check->seen);
      check->seen = larger;
      check->size = size;
   }
   for (i = (size_t)(key * 0x9e3779b97f4a7c15u >> 20) % check->size; check->seen[i] != 0; i = (i + 1) % check->size)
      if (check->seen[i] == key) return 1;
   check->seen[i] = key;
   check->n++;
   return 0;
}

/* Numbers of the usual sizes and texts. */
static int check_type(check_t *check, hid_t type)
{
   H5T_class_t class = H5Tget_class(type);
   size_t size = H5Tget_size(type);
   if (class == H5T_STRING && (H5Tis_variable_str(type) > 0 || (size > 0 && size <= MOST_VALUES))) return 0;
   if ((class == H5T_INTEGER || class == H5T_FLOAT) && size > 0 && size <= 8) return 0;
   return refuse(check, "is neither of numbers nor of texts");
}

static herr_t check_attribute(hid_t owner, const char *name, const H5A_info_t *info, void *data)
{
   check_t *check = data;
   hid_t attribute, type = -1, space = -1;
   size_t length = check->length;
   int bad = 0;
   (void)info;
   if (length + strlen(name) + 2 > sizeof check->path) return refuse(check, "has an attribute with too long a name");
   attribute = H5Aopen(owner, name, H5P_DEFAULT);
   sprintf(check->path + length, "@%s", name);
   check->length += 1 + strlen(name);
   if (attribute >= 0) type = H5Aget_type(attribute);
   if (attribute >= 0) space = H5Aget_space(attribute);
   if (type < 0 || space < 0) bad = refuse(check, "cannot be opened");
   if (!bad) bad = check_type(check, type);
   if (!bad && H5Sget_simple_extent_npoints(space) > MOST_VALUES) bad = refuse(check, "has too many values");
   if (space >= 0) H5Sclose(space);
   if (type >= 0) H5Tclose(type);
   if (attribute >= 0) H5Aclose(attribute);
   check->length = length;
   check->path[length] = '\0';
   return bad;
}

static int check_filters(check_t *check, hid_t creation)
{
   int i, n = H5Pget_nfilters(creation);
   if (n < 0) return refuse(check, "cannot be opened");
   for (i = 0; i < n; i++) {
      unsigned flags;
      size_t none = 0;
      /* without a query of its name and configuration no external code is loaded */
      H5Z_filter_t filter = H5Pget_filter2(creation, (unsigned)i, &flags, &none, NULL, 0, NULL, NULL);
      if (filter != H5Z_FILTER_DEFLATE && filter != H5Z_FILTER_SHUFFLE && filter != H5Z_FILTER_FLETCHER32)
         return refuse(check, "is packed with an unknown filter");
   }
   return 0;
}

/* Can the stored bytes expand to the size of the data set? */
static int check_size(check_t *check, hid_t dataset, hid_t creation, hid_t type, hid_t space, H5D_layout_t layout)
{
   hsize_t dims[H5S_MAX_RANK];
   int rank = H5Sget_simple_extent_ndims(space), i;
   double bytes = (double)H5Tget_size(type), chunk = bytes, stored;
   if (rank < 0 || rank > H5S_MAX_RANK || H5Sget_simple_extent_dims(space, dims, NULL) < 0)
      return refuse(check, "cannot be opened");
   for (i = 0; i < rank; i++) bytes *= (double)dims[i];
   if (layout == H5D_CHUNKED) {
      if (H5Pget_chunk(creation, H5S_MAX_RANK, dims) != rank) return refuse(check, "cannot be opened");
      for (i = 0; i < rank; i++) chunk *= (double)dims[i];
      if (chunk > LARGEST_CHUNK) return refuse(check, "has too large chunks");
   }
   if (bytes <= small || bytes <= usual_compression * (double)check->file_size) return 0;
   stored = (double)H5Dget_storage_size(dataset);
   if (stored > (double)check->file_size || bytes > best_compression * stored)
      return refuse(check, "is larger than the file can hold");
   return 0;
}

static int check_dataset(check_t *check, hid_t dataset)
{
   hid_t creation = H5Dget_create_plist(dataset), type = H5Dget_type(dataset), space = H5Dget_space(dataset);
   int bad = 0;
   if (creation < 0 || type < 0 || space < 0) {
      bad = refuse(check, "cannot be opened");
   } else {
      H5D_layout_t layout = H5Pget_layout(creation);
      if (H5Pget_external_count(creation) != 0)
         bad = refuse(check, "keeps its values in another file");
      else if (layout == H5D_VIRTUAL)
         bad = refuse(check, "is a virtual dataset");
      else if (layout != H5D_COMPACT && layout != H5D_CONTIGUOUS && layout != H5D_CHUNKED)
         bad = refuse(check, "has an unknown layout");
      if (!bad) bad = check_filters(check, creation);
      if (!bad) bad = check_type(check, type);
      if (!bad) bad = check_size(check, dataset, creation, type, space, layout);
   }
   if (space >= 0) H5Sclose(space);
   if (type >= 0) H5Tclose(type);
   if (creation >= 0) H5Pclose(creation);
   return bad;
}

static int check_group(check_t *check, hid_t group);

/* Address, attributes and content of an object. */
static int check_object(check_t *check, hid_t object)
{
   object_info_t info;
   int bad = 0;
   if (GET_OBJECT_INFO(object, &info) < 0) return refuse(check, "cannot be opened");
   switch (note_address(check, (uint64_t)info.addr)) {
   case 0: break;
   case 1: return refuse(check, "is another name of an object that is there already");
   default: return refuse(check, "cannot be noted: no memory");
   }
   if (info.num_attrs > MOST_ATTRIBUTES) return refuse(check, "has too many attributes");
   if (H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_NATIVE, NULL, check_attribute, check) < 0)
      return refuse(check, "has attributes that cannot be read");
   switch (info.type) {
   case H5O_TYPE_GROUP: bad = check_group(check, object); break;
   case H5O_TYPE_DATASET: bad = check_dataset(check, object); break;
   default: bad = refuse(check, "is neither a group nor a dataset");
   }
   return bad;
}

static herr_t check_link(hid_t group, const char *name, const link_info_t *info, void *data)
{
   check_t *check = data;
   hid_t object = -1;
   size_t length = check->length;
   int bad = 0;
   if (length + strlen(name) + 2 > sizeof check->path) return refuse(check, "holds too long a name");
   sprintf(check->path + length, "%s%s", length > 0 ? "/" : "", name);
   check->length = strlen(check->path);
   switch (info->type) {
   case H5L_TYPE_HARD: break;
   case H5L_TYPE_SOFT: bad = refuse(check, "is a soft link"); break;
   case H5L_TYPE_EXTERNAL: bad = refuse(check, "is a link into another file"); break;
   default: bad = refuse(check, "is a user-defined link");
   }
   if (!bad) {
      object = H5Oopen(group, name, H5P_DEFAULT);
      bad = object < 0 ? refuse(check, "cannot be opened") : check_object(check, object);
      if (object >= 0) H5Oclose(object);
   }
   check->length = length;
   check->path[length] = '\0';
   return bad;
}

static int check_group(check_t *check, hid_t group)
{
   int bad = 0;
   if (check->depth == DEEPEST) return refuse(check, "holds groups in too many levels");
   check->depth++;
   if (VISIT_LINKS(group, H5_INDEX_NAME, H5_ITER_NATIVE, NULL, check_link, check) < 0)
      bad = refuse(check, "is a group that cannot be listed");
   check->depth--;
   return bad;
}

/* Check the structure of an open file. 0: permitted; -1 with the problem, zero-terminated. Nothing is changed. */
int rockdda_structure_check(int64_t file, char *message, int room)
{
   check_t check;
   hid_t root = H5Gopen2((hid_t)file, "/", H5P_DEFAULT);
   int bad;
   memset(&check, 0, sizeof check);
   check.message = message;
   check.room = (size_t)room;
   message[0] = '\0';
   if (root < 0 || H5Fget_filesize((hid_t)file, &check.file_size) < 0)
      bad = refuse(&check, "cannot be opened");
   else
      bad = check_object(&check, root);
   if (root >= 0) H5Gclose(root);
   free(check.seen);
   return bad;
}

/* Kind of the values of a dataset: 1 integers of 32 bits, 2 reals of 64 bits, 3 one text, 4 texts of one
 * length, 5 reals of 32 bits, 0 anything else. */
int rockdda_structure_kind(int64_t dataset)
{
   hid_t type = H5Dget_type((hid_t)dataset), space = H5Dget_space((hid_t)dataset);
   int kind = 0;
   if (type >= 0 && space >= 0) {
      H5T_class_t class = H5Tget_class(type);
      size_t size = H5Tget_size(type);
      if (class == H5T_INTEGER && size == 4 && H5Tget_sign(type) == H5T_SGN_2) kind = 1;
      if (class == H5T_FLOAT && size == 8) kind = 2;
      if (class == H5T_FLOAT && size == 4) kind = 5;
      if (class == H5T_STRING && H5Tis_variable_str(type) > 0 && H5Sget_simple_extent_npoints(space) == 1) kind = 3;
      if (class == H5T_STRING && H5Tis_variable_str(type) == 0) kind = 4;
   }
   if (space >= 0) H5Sclose(space);
   if (type >= 0) H5Tclose(type);
   return kind;
}
