/* SPDX-License-Identifier: Apache-2.0 */
/* The interface between compiler and runtime: C structs that describe compiled programs. JIT code, generated C++ and
 * hand-written kernels look the same to the runtime.
 *
 * Layout of a field: rank axes; axis 0 (x) is contiguous. Value of cell (x, y, z), halo cells included, is
 *   base[x + y*stride[1] + z*stride[2]],  -halo[a] <= cell < cells[a] + halo[a],   `base` points at cell (0,0,0).
 * All fields of a simulation share one layout. Axes beyond rank have cells 1, halo 0.
 *
 * The cells may be a subgrid of a larger grid: its cells first[a] to first[a] + cells[a] - 1 of global[a] along axis
 * a. Everything that depends on the index of a cell or on the size of the grid (rows, coordinates, masks, noise,
 * means) uses these; memory uses `cells`. An undivided grid has global = cells, first = 0.
 *
 * Values of fields are doubles or floats, by `real` of layout and program (which must agree); pointers to them are
 * untyped. Parameters, uniforms and sums are always doubles. */
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
  int32_t real;                  /* type of a value of a field: DPDE_F64, DPDE_F32 */
  int64_t cells[DPDE_MAX_RANK];  /* interior cells an axis */
  int64_t halo[DPDE_MAX_RANK];   /* halo cells on each side */
  int64_t stride[DPDE_MAX_RANK]; /* in elements; stride[0] = 1 */
  int64_t size;                  /* elements of one field, halo and padding included */
  int64_t origin;                /* element index of cell (0,0,0) from the start of the allocation */
  int64_t global[DPDE_MAX_RANK]; /* cells of the whole grid an axis */
  int64_t first[DPDE_MAX_RANK];  /* index of cell (0,0,0) in the whole grid */
} dpde_layout;

/* Arguments of one row call. */
typedef struct dpde_row {
  void* const* streams;   /* one pointer a stream, at the row's first cell */
  void* const* grids;     /* base pointers (cell (0,0,0) of the whole grid, with the layout's strides) of fields read or
                             added to at computed positions */
  const double* uniforms; /* values common to all cells */
  double* sums;           /* row functions add their sums here, in the order of dpde_kernel.sums */
  int64_t count;          /* cells in the row */
  int64_t first;          /* x of the first cell, in the whole grid; negative on an extended domain */
  int64_t y, z;           /* position of the row, in the whole grid */
  const dpde_layout* layout; /* of the fields; for a row with grids on a subgrid: the layout of the whole grid */
  const double* own;         /* uniforms of this kernel, if other kernels share the row with other values */
} dpde_row;
typedef void (*dpde_row_fn)(const dpde_row* row);

typedef struct dpde_stream {
  int32_t field;                 /* index into dpde_program.fields */
  int32_t offset[DPDE_MAX_RANK]; /* x, y, z */
  int32_t is_written;            /* 0 read, 1 written, 2 read and written */
} dpde_stream;

/* A field that a row reads, or adds to, at computed positions. */
typedef struct dpde_grid {
  int32_t field;      /* index into dpde_program.fields */
  int32_t is_written; /* 1: the row only adds to it */
} dpde_grid;

/* Alternative code for a row with bit-identical results: which one is fastest depends on processor and grid. */
typedef struct dpde_variant {
  dpde_row_fn row;
  int32_t streams; /* 1: writes past the caches (non-temporal stores), for fields not read soon; written streams must
                      begin on 64 bytes */
  int32_t ahead;   /* 1: prefetches what it reads, for fields that lie outside the caches */
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
  int32_t own; /* index of its first own uniform: kernels that differ only in these and in their fields share a row */
} dpde_kernel;

/* fixed + per_distance*m, for a ghost cell m cells away from its mirror cell. */
typedef struct dpde_ghost_number {
  double fixed, per_distance;
} dpde_ghost_number;
typedef struct dpde_ghost_term {
  dpde_ghost_number ghost, mirror, second;
} dpde_ghost_term;
enum { DPDE_SIDE_COEFFICIENTS = 2 };
/* The equation for the ghost value v, with the value u of its mirror cell, the value w one cell farther inside and
 * the boundary value c: the sum over the coefficients of coefficient*(ghost*v + mirror*u + second*w) equals rate*c.
 * The mirror cell of layer k lies first + step*k cells inside. A coefficient DPDE_ZERO drops its term, and then
 * nothing is read. */
typedef struct dpde_ghost_row {
  dpde_ghost_term terms[DPDE_SIDE_COEFFICIENTS];
  dpde_ghost_number rate;
  int64_t first, step;
} dpde_ghost_row;
/* On axes with fewer than `least` cells `of_few` applies. */
typedef struct dpde_ghost_rows {
  dpde_ghost_row row;
  int64_t least;
  dpde_ghost_row of_few;
} dpde_ghost_rows;
/* on_walls 0: layer k is the cell -1-k or cells+k, from `beyond` with m = 2k+1. on_walls 1, at both sides of an axis
 * or at none: the cells -1 and cells-1 lie on the walls and are layer 0, from `wall`; the others from `beyond` with
 * m = 2k. The cell that is `first` cells inside is then next to the wall. On an axis with one cell, a high wall
 * whose row reads inside is not changed. A row in which no term has a `ghost` computes nothing: a high wall with it
 * is not changed. */
typedef struct dpde_rule {
  int32_t on_walls;
  int32_t turns; /* 1 at a pole: mirror cells lie half a turn away, cells/2 farther along the other one of x and y */
  dpde_ghost_rows wall, beyond;
} dpde_rule;

/* Values that replace the index of a uniform. */
enum { DPDE_ZERO = -1, DPDE_ONE = -2 };
/* One side of an axis. rule: null if the axis is periodic. coefficients: uniforms, DPDE_ZERO or DPDE_ONE. value: the
 * uniform that holds c, or DPDE_ZERO. field: index of the field that holds c at the ghost cell (periodic axes
 * wrapped), -1 if c is `value`; for a fold, the field to which the transpose adds. */
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
/* Reduces a field over the interior cells along some axes; `result` gets the reduced value at each of them. */
typedef struct dpde_reduce {
  int32_t kind;
  int32_t field, result;       /* indices into dpde_program.fields, never the same */
  int32_t over[DPDE_MAX_RANK]; /* 1: along this axis */
} dpde_reduce;

enum { DPDE_NETWORK_VALUE = 0, DPDE_NETWORK_TANGENT = 1, DPDE_NETWORK_ADJOINT = 2, DPDE_NETWORK_SECOND = 3 };
/* A network or its derivative, applied to fields: indices into dpde_program.fields; -1 for a rate that is 0 and for
 * a result that is not wanted. Tangent: rates of the inputs give rates of the outputs. Adjoint: `rates` are the
 * adjoints of the outputs (seeds), results the adjoints of the inputs. Second, the adjoint of a tangent: `rates` are
 * those of the inputs, then the adjoints of the outputs' rates; results the adjoints of the inputs, then of their
 * rates. Only interior cells are read and written. */
typedef struct dpde_inference {
  int32_t network; /* index into dpde_program.networks */
  int32_t mode;
  const int32_t* inputs;
  const int32_t* rates;
  const int32_t* results;
  int32_t weights; /* 1: tangent and second use the rates of the weights; adjoint and second add to their adjoints */
} dpde_inference;
/* Weights of one network, in its order. */
typedef struct dpde_weights {
  const double* values;
  const double* rates;           /* null: 0 */
  double* bars;                  /* adjoints, added to; may be null if no adjoint with respect to the weights is run */
  double* rate_bars;             /* adjoints of the rates, by second */
  const dpde_host_network* host; /* of a network that the host computes */
} dpde_weights;

/* A uniform (DPDE_ONE: 1) times (i*angle)^power for each axis; angle: that of a Fourier mode in radians a cell. */
typedef struct dpde_monomial {
  int32_t uniform;
  int32_t powers[DPDE_MAX_RANK]; /* plus vanishing_power (wave_functions.h) if the monomial is 0 for modes of wavelength
                                    2 cells */
} dpde_monomial;
/* A sum of monomials. */
typedef struct dpde_symbol {
  int32_t count;
  const dpde_monomial* monomials;
} dpde_symbol;
enum { DPDE_NO_FUNCTION = 0, DPDE_PHI = 1, DPDE_INVERSE = 2, DPDE_HEAVISIDE = 3 };
/* A field whose Fourier modes are multiplied by phi_N(argument)*factor, inverse_N(argument)*factor or
 * heaviside(argument)*factor (wave_functions.h), by factor alone for DPDE_NO_FUNCTION. N is `number`. A mode of
 * wavelength 2 cells along an axis has the angles pi and -pi: its multiplier is the mean over both.
 * within_two_thirds: modes of wavelength 3 cells or less along one of the axes are multiplied by 0. */
typedef struct dpde_transform_term {
  int32_t field; /* index into dpde_program.fields */
  int32_t function, number;
  dpde_symbol argument, factor;
  int32_t within_two_thirds;
} dpde_transform_term;
/* `result` gets the sum of the terms, at interior cells. Transforms run along these axes, which are periodic. */
typedef struct dpde_transform {
  int32_t term_count;
  const dpde_transform_term* terms;
  int32_t result; /* none of the terms' fields */
  int32_t axes[DPDE_MAX_RANK];
} dpde_transform;

/* Each pass computes `next` from `state`, both indices into dpde_program.fields; `next` is the `state` of the next
 * pass, that of the last pass is `result`. Passes write alternately to the memory of `result` and of `next`, the
 * last one to `result`, or to a stack if the state is saved; the memory of `state` is not changed. */
typedef struct dpde_carry {
  int32_t state, next, result;
} dpde_carry;
/* In each pass `field` is pushed onto a stack (an index into dpde_program.stacks), or is the top of it, which is
 * popped. Saved fields are: a carried state, as the pass starts with it; a loaded field; or a field that the pass
 * writes and does not carry. If the stack has no memory for it a field stays in place, as does the state of the
 * first pass. */
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
  int32_t counter; /* number of the counter, which is first + step*pass in each pass; unused if step is 0 */
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
/* Smoothers of multigrid. */
enum {
  DPDE_SMOOTHER_AUTOMATIC = 0,
  DPDE_SMOOTHER_RED_BLACK = 1,
  DPDE_SMOOTHER_JACOBI = 2,
  DPDE_SMOOTHER_CHEBYSHEV = 3
};
enum { DPDE_PRECONDITIONER_AUTOMATIC = 0, DPDE_PRECONDITIONER_MULTIGRID = 1, DPDE_PRECONDITIONER_NONE = 2 };
/* The operations compute `images` from `unknowns`, linearly: images = A*unknowns. Solves images = rights (indices
 * into dpde_program.fields) in the interior; if A is singular, the least-squares solution of smallest norm. A
 * changes only with its coefficients and parameters. If the operations are not linear the unknowns are found by
 * Newton's method, starting from `rights`: in each iteration `step` solves the linearised system with the residual
 * as its `rights` for the increment. */
typedef struct dpde_solve {
  int32_t count; /* number of images, of right sides and of unknowns */
  const int32_t *images, *rights, *unknowns;
  int32_t operation_count;
  const struct dpde_operation* operations;
  int32_t method;
  int32_t smoother;
  double tolerance;             /* linear: of |images - rights|/|rights|; nonlinear: of |last increment|/|unknowns| */
  int32_t most_iterations;      /* for iterative methods */
  int32_t warns;                /* 1: missing the tolerance gives a warning, not an error */
  int64_t reach[DPDE_MAX_RANK]; /* stencil radius; -1: the whole axis */
  int32_t coefficient_count;
  const int32_t* coefficients; /* indices into dpde_program.fields */
  int32_t param_count;
  const int32_t* params; /* indices into the parameters, counters after them */
  int32_t is_linear;
  const struct dpde_solve* step; /* null: the solve is linear, or only an interpreter runs it */
  int32_t preconditioner;        /* for cg, bicgstab and gmres */
  int32_t guess_count;           /* fields whose best linear combination is the initial guess; 0: start with 0 */
  const int32_t* guesses;
  /* Null: none. Else, for cg or gmres, replaces the preconditioner: the network maps the residual of an iteration
   * (its first input), divided by its root mean square, to the next search direction. */
  const dpde_inference* network;
  /* Properties of the operator A for all values of coefficients and parameters. */
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
  int64_t grow[DPDE_MAX_RANK]; /* DPDE_SWEEP: width by which the region extends beyond the interior on each side of the
                                  axis; DPDE_FOLD: halo cells folded on each side; 0 on periodic axes */
  int32_t serial;              /* 1: rows must run in order on one thread */
  int32_t then_count;          /* fills to be done together with the sweep */
  const dpde_fill* then;
  dpde_reduce reduce;       /* of DPDE_REDUCE */
  dpde_inference inference; /* of DPDE_NETWORK */
  dpde_repeat repeat;       /* of DPDE_REPEAT */
  dpde_transform transform; /* of DPDE_TRANSFORM */
  dpde_solve solve;         /* of DPDE_SOLVE */
} dpde_operation;

typedef struct dpde_swap {
  int32_t state, next; /* field indices: after a step `next` becomes `state` */
  int32_t is_over;     /* 1: both may share memory, so that the step overwrites the state */
} dpde_swap;

enum { DPDE_LINK_FIELD = 0, DPDE_LINK_PARAM = 1, DPDE_LINK_SUM = 2 };
/* In a tangent or an adjoint: the counterpart of a value of its primal program. In a tangent the kind is the same;
 * in an adjoint a parameter becomes a sum and a sum a parameter. A value without a link must not vary: users of the
 * derivative report it as an error. */
typedef struct dpde_link {
  int32_t kind;       /* DPDE_LINK_...: kind of the primal value */
  const char* primal; /* name of the primal value */
  int32_t derived_kind;
  int32_t derived; /* index among the fields, params or sums here; -1: the derivative is 0 */
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
  int32_t counter_count; /* counters of passes, stored after the parameters */
  int32_t uniform_count;
  void (*compute_uniforms)(const double* params, double* uniforms);
  void (*compute_counted)(const double* params, double* uniforms); /* only those that depend on counters */
  int32_t sum_count;
  const char* const* sums;
  int32_t kernel_count;
  const dpde_kernel* kernels;
  int32_t prepare_count;
  const dpde_fill* prepare;
  int32_t operation_count;
  const dpde_operation* operations;
  int32_t stack_count;
  const int64_t* stacks; /* capacity of each, in fields */
  int32_t swap_count;
  const dpde_swap* swaps;
  int32_t network_count;
  const dpde_network* const* networks;
  int32_t link_count; /* of a tangent or an adjoint */
  const dpde_link* links;
  /* Not null: the reference interpreter, which runs the whole program in place of the operations above. fields: base
   * pointers, one a field. weights: one a network. sums: set to the program's sums. */
  void (*interpret)(void* context, const dpde_layout* layout, void* const* fields, const double* params,
                    const dpde_weights* weights, double* sums);
  void* context;
} dpde_program;

/* An adjoint of a step that may replace the plain one. It takes the adjoints of unknown fields as inputs and adds to
 * them. `step`: null: the scene's; else a step that also outputs the fields that the adjoint reads in place of states.
 */
typedef struct {
  const dpde_program* adjoint;
  const dpde_program* step;
} dpde_adjoint_variant;

#ifdef __cplusplus
}
#endif
#endif
