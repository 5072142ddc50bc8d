/* Every device operation and its parameters. Read by C++, OpenCL C, CUDA and GLSL: plain structs of ints, 124 bytes at
   most. Buffers, their order and their element types are those of the reference's signature, src/reference/<op>.cpp.

   Layouts shared by the marker operations
     pixels     u32[padded_height, padded_width / 4]: four u8 a word, leftmost in the lowest byte. padded_width is a
                multiple of 32, padded_height of 4; the host repeats the last column and row into the padding.
     tiles      4 × 4 pixels; u32[tile_rows, tile_row_words]: four tiles a word, leftmost in the lowest byte.
     bits       u32[height, row_words]: 32 pixels a word, leftmost in the lowest bit; bits past the width are 0.
     run end    where a row of bits changes: even ids are starts (first black pixel), odd ids ends (first pixel after),
                numbered in raster order. x is a crack between pixels: x = k lies left of pixel k.
     node       u32 a run end: x in the low half, the step to its successor's id (s16) in the high half.
     offsets    u32: for each word of bits the run ends before it within its group of 128 words, then for each group
                the run ends before it; see run_count.

   Layouts of the network's operations (docs/network-arithmetic.md)
     tensor     u32[count, height, width, words]: four channels a word, s8, the first in the lowest byte; channels past
                the last are 0.
     channels   s32[channels, 2]: the bias and the multiplier M of each. */
#ifndef BERTH_KERNELS_OPS_H
#define BERTH_KERNELS_OPS_H

#define BERTH_OPS(X)     \
  X(flat_field)          \
  X(halve)               \
  X(tile_extrema)        \
  X(tile_histogram)      \
  X(normalize)           \
  X(threshold)           \
  X(despeckle)           \
  X(run_count)           \
  X(scan)                \
  X(run_emit)            \
  X(run_link)            \
  X(contour_measure)     \
  X(contour_collect)     \
  X(contour_trace)       \
  X(quad_fit)            \
  X(edge_refine)         \
  X(extract_window)      \
  X(window_statistics)   \
  X(normalize_window)    \
  X(convolve)            \
  X(local_response_norm) \
  X(max_pool)            \
  X(fully_connected)

struct flat_field_params {
  int words; /* pixel words */
};

struct halve_params {
  int row_words; /* pixel words in a row of the image: padded_width / 4 */
  int rows;      /* padded_height */
  int half_row_words;
  int half_rows;
};

struct tile_extrema_params {
  int row_words; /* tile words in a row: padded_width / 16 */
  int tile_rows; /* padded_height / 4 */
};

struct tile_histogram_params {
  int words;  /* tile words in the image */
  int step;   /* every step-th word is counted */
  int groups; /* partial histograms, one a work-group */
};

struct normalize_params {
  int groups;            /* partial histograms to add up */
  int black_permille;    /* the black level is this quantile of the tiles' minima … */
  int white_permille;    /* … the white level this one of their maxima … */
  int noise_permille;    /* … and the noise this one of their ranges */
  int contrast_permille; /* asked contrast as a share of white - black */
  int noise_gain_q4;     /* asked contrast as a multiple of the noise, q4 */
  int min_contrast;      /* bounds of the contrast, grey levels */
  int max_contrast;
};

struct threshold_params {
  int width; /* of the image, px */
  int height;
  int row_words; /* words of bits in a row: padded_width / 32 */
  int tile_rows;
  int cut; /* where black ends between the darkest and the lightest pixel around, q8: 0 to 255 */
};

struct despeckle_params {
  int height;
  int row_words;
};

struct run_count_params {
  int height;
  int row_words;
  int base_at; /* where in offsets the group totals begin: a multiple of 128 above height * row_words */
};

struct scan_params {
  int first; /* values[first, first + count) become their exclusive prefix sums, values[first + count] the total */
  int count;
};

struct run_emit_params {
  int height;
  int row_words;
  int base_at;
  int capacity; /* of run ends; rows that do not fit whole are dropped, and all below them */
};

struct run_link_params {
  int height;
  int row_words;
  int base_at;
  int capacity;
};

struct contour_measure_params {
  int height;
  int row_words;
  int base_at;
  int capacity;   /* of run ends */
  int totals_at;  /* where in spans the group totals begin: a multiple of 128, capacity / 2 or above */
  int groups;     /* groups of 128 runs */
  int min_side;   /* least width and height of a contour, px */
  int min_area;   /* least area, px^2 */
  int max_side;   /* greatest width and height, px: 16000 at most */
  int want_outer; /* keep dark regions' outlines */
  int want_holes; /* keep dark regions' holes (families with a reversed border) */
};

struct contour_collect_params {
  int height;
  int row_words;
  int base_at;
  int totals_at;
  int groups; /* groups of 128 runs */
  int max_contours;
  int max_points;
};

struct contour_trace_params {
  int max_contours;
};

struct quad_fit_params {
  int max_contours;
  int min_side_px; /* least length of a side, px */
  int max_width;   /* of the image, px: no contour is wider or higher, so devices choose by it how they run it */
  int max_height;
  int margin; /* contours nearer to the image's border are no quadrilaterals, px: 0 where the border is the frame's */
};

struct edge_refine_params {
  int scale; /* pixels a pixel of the image that the quadrilaterals were found in: 1, or 2 for the halved one */
  int width;
  int height;
  int row_words; /* pixel words in a row: padded_width / 4 */
  int max_contours;
};

struct extract_window_params {
  int width; /* of the image, px */
  int height;
  int row_words; /* pixel words in a row: padded_width / 4 */
  int count;     /* windows */
  int out_words; /* pixel words in a row of a window */
  int out_height;
};

struct window_statistics_params {
  int count;  /* windows: a work-group each */
  int words;  /* pixel words of a window */
  int stride; /* every stride-th word is counted, 66051 pixels at most */
};

struct normalize_window_params {
  int count;
  int words; /* pixel words of a window */
};

struct convolve_params {
  int count; /* tensors */
  int height;
  int width;
  int words;
  int out_height;
  int out_width;
  int out_words;
  int kernel_height;
  int kernel_width;
  int stride_y;
  int stride_x;
  int pad_y; /* rows of zeros above */
  int pad_x;
  int group_words;     /* input words of a group: words / groups */
  int group_out_words; /* output words of a group: out_words / groups */
  int shift;           /* of the requantisation: 0 to 31 */
};

struct local_response_norm_params {
  int pixels; /* of all tensors */
  int words;
};

struct max_pool_params {
  int count; /* tensors */
  int height;
  int width;
  int words;
  int out_height; /* (height - kernel_side) / stride + 1, rounded down */
  int out_width;
  int kernel_side;
  int stride;
};

struct fully_connected_params {
  int count; /* tensors */
  int height;
  int width;
  int words;
  int rows; /* of the kernel */
  int columns;
  int grid_height; /* positions in a tensor: at most height - rows + 1 */
  int grid_width;
  int out_channels; /* a multiple of 4 */
  int shift;        /* of the requantisation: 0 to 31, or -1 for the sums as they are */
};

/* Words of a contour record in `contours` (after a header of 8: run ends, contours and points that were needed). */
#define CONTOUR_HEADER 8
#define CONTOUR_WORDS 4 /* id of the first node; nodes, bit 31 set for a hole; row of the first node; first point */
#define CONTOUR_HOLE 0x80000000u

/* Words of a quadrilateral in `quads`: flags, then five words a side. */
#define QUAD_WORDS 24
#define QUAD_VALID 1
#define QUAD_HOLE 2
#define QUAD_SIDE 4       /* where side 0 begins; words 1 … 3 are nodes, area (px^2) and the greatest side (px) */
#define QUAD_SIDE_WORDS 5 /* axis | u_ref << 1, v_ref, slope, u_first, u_last: see quad_fit */

/* Words of a quadrilateral's refined sides in `edges`, in the whole image whatever the scale: v_ref (at scale times
   the quadrilateral's u_ref), slope, stations used, residual. */
#define EDGE_WORDS 16
#define EDGE_SIDE_WORDS 4

/* Neighbouring output pixels that an item of convolve makes, of one word: a launch has count * out_height *
   ceil(out_width / CONVOLVE_PIXELS) * out_words items. */
#define CONVOLVE_PIXELS 16

/* Output words, and positions, that a work-group of fully_connected makes: a launch has ceil(out_channels / 4 /
   FULLY_CONNECTED_WORDS) * ceil(count * grid_height * grid_width / FULLY_CONNECTED_POSITIONS) groups. */
#define FULLY_CONNECTED_WORDS 4
#define FULLY_CONNECTED_POSITIONS 4

/* Entries of the table of local_response_norm. */
#define RESPONSE_TABLE 104

#endif
