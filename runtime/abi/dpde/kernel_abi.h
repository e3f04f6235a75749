/* SPDX-License-Identifier: Apache-2.0 */
/* The one thing the compiler and the runtime both know: C structs that describe compiled programs.
 * JIT code, generated C++ and hand-written kernels all look alike to the runtime.
 *
 * Layout of a field: rank axes; axis 0 (x) is contiguous. Value of cell (x, y, z), halo cells included, is
 *   base[x + y*stride[1] + z*stride[2]],  -halo[a] <= cell < cells[a] + halo[a],   `base` points at cell (0,0,0).
 * All fields of a simulation share one layout. Axes beyond rank have cells 1, halo 0.
 *
 * The cells may be a subgrid of a larger grid: those with the numbers first[a] to first[a] + cells[a] - 1 of its
 * global[a] ones. What asks for the number of a cell or for the size of the grid (rows, coordinates, masks, noise,
 * means) goes by these; memory goes by `cells`. A grid alone has global = cells, first = 0.
 *
 * Values of fields are doubles or floats, by `real` of layout and program (they agree); pointers to them are untyped.
 * Parameters, uniforms and sums are doubles in any case.
 */
#ifndef DPDE_KERNEL_ABI_H
#define DPDE_KERNEL_ABI_H

#include <stdint.h>

#include "dpde/network_abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define DPDE_ABI_VERSION 28
#define DPDE_MAX_RANK 3

enum { DPDE_F64 = 0, DPDE_F32 = 1 };

typedef struct dpde_layout {
  int32_t rank;
  int32_t real;                  /* DPDE_F64, DPDE_F32: what a value of a field is */
  int64_t cells[DPDE_MAX_RANK];  /* interior cells an axis */
  int64_t halo[DPDE_MAX_RANK];   /* halo cells on each side */
  int64_t stride[DPDE_MAX_RANK]; /* in elements; stride[0] = 1 */
  int64_t size;                  /* elements of one field, halo and padding included */
  int64_t origin;                /* element index of cell (0,0,0) from the start of the allocation */
  int64_t global[DPDE_MAX_RANK]; /* cells of the whole grid an axis */
  int64_t first[DPDE_MAX_RANK];  /* number of cell (0,0,0) in it */
} dpde_layout;

/* Arguments of one row call. */
typedef struct dpde_row {
  void* const* streams;   /* one pointer a stream, at the row's first cell */
  void* const* grids;     /* base pointers (cell (0,0,0) of the whole grid, with the layout's strides) of fields read or
                             scattered to at computed places */
  const double* uniforms; /* values common to all cells */
  double* sums;           /* row functions add their sums here, in the order of dpde_kernel.sums */
  int64_t count;          /* cells in the row */
  int64_t first;          /* x of the first cell, in the whole grid; negative on a grown region */
  int64_t y, z;           /* place of the row, in the whole grid */
  const dpde_layout* layout; /* of the fields; of a subgrid's row that has grids: theirs, of the whole grid */
  const double* own;         /* uniforms of this kernel, where others run the same row with theirs */
} dpde_row;
typedef void (*dpde_row_fn)(const dpde_row* row);

typedef struct dpde_stream {
  int32_t field;                 /* index into dpde_program.fields */
  int32_t offset[DPDE_MAX_RANK]; /* x, y, z */
  int32_t is_written;            /* 0 read, 1 written, 2 read and written */
} dpde_stream;

/* A field that a row reads, or adds to, at places that are computed. */
typedef struct dpde_grid {
  int32_t field;      /* index into dpde_program.fields */
  int32_t is_written; /* 1: it is added to, and not read */
} dpde_grid;

/* Other code for a row that gives the same values to the last bit: which is fastest depends on processor and grid. */
typedef struct dpde_variant {
  dpde_row_fn row;
  int32_t streams; /* 1: what it writes goes past the caches and is better not read soon; written streams begin on 64
                      bytes */
  int32_t ahead;   /* 1: fetches what it reads before it is used: for fields that lie outside the caches */
} dpde_variant;

typedef struct dpde_kernel {
  const char* name;
  dpde_row_fn row;
  int32_t stream_count;
  const dpde_stream* streams;
  int32_t grid_count;
  const dpde_grid* grids;
  int32_t sum_count;
  const int32_t* sums; /* indices into dpde_program.sums */
  int32_t variant_count;
  const dpde_variant* variants;
  int32_t own; /* index of the first of its own uniforms: kernels that differ in these and in their fields only share a
                  row */
} dpde_kernel;

/* fixed + per_distance*m, for a place m cells away from its mirror image. */
typedef struct dpde_ghost_number {
  double fixed, per_distance;
} dpde_ghost_number;
typedef struct dpde_ghost_term {
  dpde_ghost_number place, image, behind;
} dpde_ghost_term;
enum { DPDE_SIDE_COEFFICIENTS = 2 };
/* What holds between v at a place beyond a side, u at its image, w one cell farther inside, and c: the sum over the
 * coefficients of coefficient*(place*v + image*u + behind*w) is rate*c. The image of layer k lies first + step*k cells
 * inside. A coefficient that is DPDE_ZERO has no part in it, so that nothing may be read. */
typedef struct dpde_ghost_row {
  dpde_ghost_term terms[DPDE_SIDE_COEFFICIENTS];
  dpde_ghost_number rate;
  int64_t first, step;
} dpde_ghost_row;
/* On axes with fewer than `least` cells the second row holds. */
typedef struct dpde_ghost_rows {
  dpde_ghost_row row;
  int64_t least;
  dpde_ghost_row of_few;
} dpde_ghost_rows;
/* on_walls 0: layer k is the cell -1-k or cells+k, from `beyond` with m = 2k+1. 1, at both sides of an axis or at none:
 * cells -1 and cells-1 are layer 0, on the walls, from `wall`, the others from `beyond` with m = 2k. There a cell that
 * is `first` cells inside lies beside the wall. One cell: a high wall that reads inside stays as it is.
 * A row in which no term has a place makes nothing: a high wall with it stays as it is. */
typedef struct dpde_rule {
  int32_t on_walls;
  int32_t turns; /* 1 at a pole: images lie half a turn away, cells/2 farther on along the other one of x and y */
  dpde_ghost_rows wall, beyond;
} dpde_rule;

/* In place of the index of a uniform. */
enum { DPDE_ZERO = -1, DPDE_ONE = -2 };
/* One side of an axis. rule: null where the axis is periodic. coefficients: uniforms, DPDE_ZERO or DPDE_ONE. value: the
 * uniform that holds c; DPDE_ZERO. field: index of the field that holds c at the place that is filled (along periodic
 * axes wrapped), -1 where c is `value`; for a fold, the field its transpose is added to. */
typedef struct dpde_side {
  const dpde_rule* rule;
  int32_t coefficients[DPDE_SIDE_COEFFICIENTS];
  int32_t value;
  int32_t field;
} dpde_side;
typedef struct dpde_boundary {
  dpde_side low, high;
} dpde_boundary;

typedef struct dpde_fill {
  int32_t field;
  dpde_boundary axes[DPDE_MAX_RANK];
} dpde_fill;

enum { DPDE_MEAN = 0, DPDE_SUM = 1, DPDE_MAX = 2, DPDE_MIN = 3 };
/* The values of a field over the interior cells along some axes become one, which `result` gets at all of them. */
typedef struct dpde_reduce {
  int32_t kind;
  int32_t field, result;       /* indices into dpde_program.fields, never the same */
  int32_t over[DPDE_MAX_RANK]; /* 1: along this axis */
} dpde_reduce;

enum { DPDE_NETWORK_VALUE = 0, DPDE_NETWORK_TANGENT = 1, DPDE_NETWORK_ADJOINT = 2, DPDE_NETWORK_SECOND = 3 };
/* A network or its derivative, done to fields: indices into dpde_program.fields; -1 for a rate that is 0 and for a
 * result that is not wanted. Tangent: rates of the inputs to rates of the outputs. Adjoint: rates are the seeds of the
 * outputs, results the adjoints of the inputs. Second, the adjoint of a tangent: rates are those of the inputs, then
 * the seeds of the outputs' rates; results the adjoints of the inputs, then those of their rates. Interior cells only
 * are read and written. */
typedef struct dpde_inference {
  int32_t network; /* index into dpde_program.networks */
  int32_t mode;
  const int32_t* inputs;
  const int32_t* rates;
  const int32_t* results;
  int32_t weights; /* 1: tangent and second take the rates of the weights along, adjoint and second add to their bars */
} dpde_inference;
/* Of one network, in its order. */
typedef struct dpde_weights {
  const double* values;
  const double* rates;           /* null: 0 */
  double* bars;                  /* added to; may be null where no adjoint by the weights is run */
  double* rate_bars;             /* likewise of the rates, by second */
  const dpde_host_network* host; /* of networks that the host computes */
} dpde_weights;

/* A uniform (DPDE_ONE: 1) times (i*angle)^power for each axis, with the angles of a wave in radians a cell. */
typedef struct dpde_monomial {
  int32_t uniform;
  int32_t powers[DPDE_MAX_RANK]; /* plus vanishing_power (wave_functions.h) where waves of two cells have none */
} dpde_monomial;
/* Their sum. */
typedef struct dpde_symbol {
  int32_t count;
  const dpde_monomial* monomials;
} dpde_symbol;
enum { DPDE_NO_FUNCTION = 0, DPDE_PHI = 1, DPDE_INVERSE = 2, DPDE_HEAVISIDE = 3 };
/* A field whose waves are multiplied by phi_N(argument)*factor, inverse_N(argument)*factor or
 * heaviside(argument)*factor (wave_functions.h), by factor alone where there is no function. N is `number`.
 * A wave of two cells along an axis is that of the angle pi and of -pi: its multiplier is the mean over both.
 * within_two_thirds: by 0 where a wave has three cells or fewer along one of the axes. */
typedef struct dpde_transform_term {
  int32_t field; /* index into dpde_program.fields */
  int32_t function, number;
  dpde_symbol argument, factor;
  int32_t within_two_thirds;
} dpde_transform_term;
/* `result` gets the sum of the terms, at interior cells. Waves go along these axes, which are periodic. */
typedef struct dpde_transform {
  int32_t term_count;
  const dpde_transform_term* terms;
  int32_t result; /* none of the terms' fields */
  int32_t axes[DPDE_MAX_RANK];
} dpde_transform;

/* What a pass makes of `state`, both indices into dpde_program.fields, is written under `next`: the `state` of the next
 * pass, and of the last one `result`. Passes write to the memory of `result` and to that of `next` in turn, the last
 * one to that of `result`, or where the state is saved to a stack; the memory of `state` stays as it is. */
typedef struct dpde_carry {
  int32_t state, next, result;
} dpde_carry;
/* The field of each pass goes onto a stack (an index into dpde_program.stacks), or is what was put there last and not
 * taken yet. What goes there is a state that is carried, as the pass begins with it; what the pass loads; or what it
 * writes and does not carry. Where the stack has no memory it stays where it is, as does the state of the first pass.
 */
typedef struct dpde_stacked {
  int32_t field, stack;
} dpde_stacked;
typedef struct dpde_repeat {
  int64_t count;
  int32_t operation_count; /* of one pass */
  const struct dpde_operation* operations;
  int32_t carry_count;
  const dpde_carry* carries;
  int32_t save_count;
  const dpde_stacked* saves;
  int32_t load_count;
  const dpde_stacked* loads;
  int32_t counter; /* number of the counter that is first + step*pass in each pass; of none where step is 0 */
  int64_t first, step;
} dpde_repeat;

enum {
  DPDE_SOLVE_AUTOMATIC = 0,
  DPDE_SOLVE_DIRECT = 1,
  DPDE_SOLVE_TRIDIAGONAL = 2,
  DPDE_SOLVE_FOURIER = 3,
  DPDE_SOLVE_MULTIGRID = 4,
  DPDE_SOLVE_CG = 5,
  DPDE_SOLVE_BICGSTAB = 6,
  DPDE_SOLVE_GMRES = 7
};
/* Of the cycles of multigrid. */
enum {
  DPDE_SMOOTHER_AUTOMATIC = 0,
  DPDE_SMOOTHER_RED_BLACK = 1,
  DPDE_SMOOTHER_JACOBI = 2,
  DPDE_SMOOTHER_CHEBYSHEV = 3
};
enum { DPDE_PRECONDITIONER_AUTOMATIC = 0, DPDE_PRECONDITIONER_MULTIGRID = 1, DPDE_PRECONDITIONER_NONE = 2 };
/* The operations make `images` of `unknowns`, linearly: these become what makes them equal to `rights` (indices into
 * dpde_program.fields); of all that come as near as can be the smallest, in the interior. The operator changes with its
 * coefficients and parameters only. Where it is not linear the unknowns are what Newton's method comes to that begins
 * with `rights`: in each step `step` is a linear solve with what is left of the right sides (its `rights`) for what is
 * to be added to the unknowns. */
typedef struct dpde_solve {
  int32_t count; /* of images, as many right sides and unknowns */
  const int32_t *images, *rights, *unknowns;
  int32_t operation_count;
  const struct dpde_operation* operations;
  int32_t method;
  int32_t smoother;
  double tolerance;             /* of |images - rights| / |rights|; not linear: of the last change / unknowns */
  int32_t most_iterations;      /* of methods that come near step by step */
  int32_t warns;                /* what does not come to the tolerance is no error */
  int64_t reach[DPDE_MAX_RANK]; /* how many cells away the image looks; -1: as far as the axis goes */
  int32_t coefficient_count;
  const int32_t* coefficients; /* indices into dpde_program.fields */
  int32_t param_count;
  const int32_t* params; /* indices into parameters, with the numbers of counters behind them */
  int32_t is_linear;
  const struct dpde_solve* step; /* null: of one that is linear, or that only an interpreter runs */
  int32_t preconditioner;        /* of cg, bicgstab and gmres */
  int32_t guess_count;           /* fields with the best sum of whose multiples methods by steps begin; 0: with 0 */
  const int32_t* guesses;
  /* Null: none. Else of cg or gmres and in place of the one above: what is made of what an iteration leaves, the first
   * input, over the root of its mean square, is the direction in which the next one looks. */
  const dpde_inference* network;
  /* What the operator A is whatever the values of coefficients and parameters are. */
  int32_t is_symmetric, takes_constants_to_zero /* A*1 = 0 */, sums_to_zero /* A^T*1 = 0 */;
} dpde_solve;

enum {
  DPDE_FILL = 0,
  DPDE_FOLD = 1,
  DPDE_SWEEP = 2,
  DPDE_REDUCE = 3,
  DPDE_NETWORK = 4,
  DPDE_REPEAT = 5,
  DPDE_TRANSFORM = 6,
  DPDE_SOLVE = 7
};
typedef struct dpde_operation {
  int32_t kind;
  dpde_fill fill;              /* of DPDE_FILL and DPDE_FOLD */
  int32_t kernel;              /* of DPDE_SWEEP: index into dpde_program.kernels */
  int64_t grow[DPDE_MAX_RANK]; /* DPDE_SWEEP: cells by which the region exceeds the interior on each side of the
                                  axis; DPDE_FOLD: halo cells folded on each side; 0 on periodic axes */
  int32_t serial;              /* rows must run in order on one thread */
  int32_t then_count;          /* fills to be done with the sweep */
  const dpde_fill* then;
  dpde_reduce reduce;       /* of DPDE_REDUCE */
  dpde_inference inference; /* of DPDE_NETWORK */
  dpde_repeat repeat;       /* of DPDE_REPEAT */
  dpde_transform transform; /* of DPDE_TRANSFORM */
  dpde_solve solve;         /* of DPDE_SOLVE */
} dpde_operation;

typedef struct dpde_swap {
  int32_t state, next; /* field indices: after a step `next` becomes `state` */
  int32_t is_over;     /* 1: both may have the same memory, so that the step is written over the state */
} dpde_swap;

enum { DPDE_LINK_FIELD = 0, DPDE_LINK_PARAM = 1, DPDE_LINK_SUM = 2 };
/* In a tangent or an adjoint: what a value of the program it was made of became here. In a tangent the kind stays; in
 * an adjoint a parameter becomes a sum and a sum a parameter. What varies and has no link is an error of whoever asks
 * for it. */
typedef struct dpde_link {
  int32_t kind;       /* DPDE_LINK_...: of the value there */
  const char* primal; /* its name there */
  int32_t derived_kind;
  int32_t derived; /* index among the fields, params or sums here; -1: nothing acts through it, its derivative is 0 */
} dpde_link;

typedef struct dpde_program {
  int32_t version; /* DPDE_ABI_VERSION */
  const char* name;
  int32_t rank;
  int32_t real;                     /* of its rows: DPDE_F64, DPDE_F32 */
  int64_t halo[DPDE_MAX_RANK];      /* least halo the layout must have */
  int32_t field_count, input_count; /* inputs come first */
  const char* const* fields;
  int32_t param_count;
  const char* const* params;
  int32_t counter_count; /* numbers of passes: they lie behind the parameters */
  int32_t uniform_count;
  void (*compute_uniforms)(const double* params, double* uniforms);
  void (*compute_counted)(const double* params, double* uniforms); /* those again that depend on counters */
  int32_t sum_count;
  const char* const* sums;
  int32_t kernel_count;
  const dpde_kernel* kernels;
  int32_t prepare_count;
  const dpde_fill* prepare;
  int32_t operation_count;
  const dpde_operation* operations;
  int32_t stack_count;
  const int64_t* stacks; /* as many fields as each needs memory for */
  int32_t swap_count;
  const dpde_swap* swaps;
  int32_t network_count;
  const dpde_network* const* networks;
  int32_t link_count; /* of a tangent or an adjoint */
  const dpde_link* links;
  /* Not null: runs the whole program in place of the operations above (the reference interpreter).
   * fields: base pointers, one a field. weights: one a network. sums: set to the program's sums. */
  void (*interpret)(void* context, const dpde_layout* layout, void* const* fields, const double* params,
                    const dpde_weights* weights, double* sums);
  void* context;
} dpde_program;

#ifdef __cplusplus
}
#endif
#endif
