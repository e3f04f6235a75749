/* SPDX-License-Identifier: Apache-2.0 */
/* A compiled scene, and its task, as plain C data: programs (kernel_abi.h) and the numbers they run with. The same
 * for dpde::Simulation (dpde/runtime/simulation.h), whether compiled in memory or ahead of time. */
#ifndef DPDE_SCENE_ABI_H
#define DPDE_SCENE_ABI_H

#include "dpde/kernel_abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define DPDE_SCENE_VERSION 16

typedef struct dpde_axis {
  const char* name;
  double low, high;
  int64_t cells; /* as the scene says; the programs run on any number */
  int32_t is_periodic;
  const double* centres; /* null: uniform. Else a stretched or descending axis, whose number of cells is fixed */
} dpde_axis;

typedef struct dpde_value {
  const char* name;
  double value;
  int32_t is_fixed; /* the grid, times or the like were computed from it: its value cannot be changed */
} dpde_value;

/* A parameter (also among the params) with values[n / every] in step n, then the last one. */
typedef struct dpde_control {
  const char* name;
  int32_t every, count;
  const double* values; /* of an unknown: its first guess */
} dpde_control;

/* A field. has_formula 0: only the host can give its values. */
typedef struct dpde_source {
  const char* name;
  int32_t has_formula;
} dpde_source;

/* A given field. every > 0: a control field, which has `count` fields, one for each interval of `every` steps. Its
 * formula is then a separate program, run once for each interval with t at its middle. */
typedef struct dpde_coefficient {
  const char* name;
  int32_t has_formula; /* of an unknown control field: formula of its first guess */
  int32_t every, count;
  const dpde_program* formula; /* computes the field; null: coefficient_formulas does */
} dpde_coefficient;

/* A field of independent standard normal numbers, one a cell: see dpde/runtime/random.h. */
typedef struct dpde_noise {
  const char* name;
  uint64_t seed;
} dpde_noise;

/* States of a run by their numbers, increasing. count -1: every state from the first to the last. */
typedef struct dpde_instants {
  int32_t count;
  const int32_t* steps;
} dpde_instants;

/* Data that losses compare with, given by the host: one state for each instant; count 0: one state for all of them. */
typedef struct dpde_datum {
  const char* name;
  dpde_instants at;
  int32_t is_number; /* 1: each state is one number, the same in all cells */
} dpde_datum;

/* For Hessian products: a tangent and its adjoint. All tangents of a scene use the same name for the rate of a
 * value. */
typedef struct dpde_second {
  const dpde_program* tangent;
  const dpde_program* adjoint;
} dpde_second;

typedef struct dpde_loss {
  const dpde_program* loss; /* its one sum is the loss */
  const dpde_program* adjoint;
  dpde_instants at;
  dpde_second full;         /* null programs: no unknown affects the loss, or see dpde_scene::no_second */
  dpde_second gauss_newton; /* the same with the squares of the residuals' rates, for Gauss-Newton; null: the loss is
                          not a sum of squares */
  const char* average;      /* not null: not a loss; it adds to this parameter of losses of averages */
  int32_t of_averages;      /* 1: computed from such parameters, once a run; `at` is empty */
  double weight;            /* factor of the contribution of each state */
} dpde_loss;

enum {
  DPDE_UNKNOWN_PARAM = 0,
  DPDE_UNKNOWN_INITIAL = 1,
  DPDE_UNKNOWN_COEFFICIENT = 2,
  DPDE_UNKNOWN_CONTROL = 3,
  DPDE_UNKNOWN_NETWORK = 4
};
enum { DPDE_START_SCENE = 0, DPDE_START_FORMULA = 1, DPDE_START_HOST = 2 };
typedef struct dpde_unknown {
  const char* name;
  int32_t kind;
  int32_t start;    /* first guess of a field: from the scene, from program `start`, or from the host */
  double low, high; /* infinite: no bounds */
} dpde_unknown;

enum { DPDE_GRADIENT_DESCENT = 0, DPDE_ADAM = 1, DPDE_LBFGS = 2, DPDE_NEWTON_CG = 3 };
typedef struct dpde_optimiser {
  int32_t method;
  double rate;          /* of gradient descent and Adam */
  int32_t gauss_newton; /* of Newton's method: 1: Gauss-Newton approximation of the Hessian */
  int32_t iterations;
} dpde_optimiser;

/* order: the error estimate of `trial` is of order step^order for small steps. first: length of the first substep to
 * try. */
typedef struct dpde_step_control {
  int32_t order;
  double first;
} dpde_step_control;

/* The formula of `in` contains that of `name`, a coefficient or an initial state, and so does not follow values that
 * the host gives for `name`. */
typedef struct dpde_put_in {
  const char* name;
  const char* in;
} dpde_put_in;

/* A divisor of a formula or the argument of a switch, as a field that `watched` computes. A gradient lacks the effect
 * of a change: of the sign in a cell; of a switch in any case, also from cell to cell. */
typedef struct dpde_watched {
  const char* field;
  const char *below, *above; /* states of `watched_step`; null: it does not occur in the step */
  const char *text, *help;   /* the subject of a sentence on its effect; what to write instead */
  int32_t is_switch;
  int32_t begins_with_one_sign; /* 1: initially it must have one sign in all cells, if formulas determine it */
  int32_t loss;                 /* > 0: it occurs only in the loss of that number, counted from 1 */
} dpde_watched;

/* As written in the source: "m/s". */
typedef struct dpde_unit {
  const char* name; /* of a field, a component of a vector, a parameter, an observable, an axis, t */
  const char* unit;
} dpde_unit;

/* A recorded output with a formula. */
typedef struct dpde_output {
  const char* name;
  const char* field; /* computed by the program of outputs */
} dpde_output;

typedef struct dpde_scene {
  int32_t version; /* DPDE_SCENE_VERSION */
  const char* name;
  const char* task; /* null: the scene has no task */
  int32_t rank;
  dpde_axis axes[DPDE_MAX_RANK];
  double t_begin, step;
  int32_t steps;
  double steady; /* > 0: the run ends when no state changes by more per unit of time; see RolloutSetup::steady in
                    dpde/runtime/rollout.h */
  int32_t param_count;
  const dpde_value* params; /* for an unknown: its first guess */
  int32_t control_count;
  const dpde_control* controls;
  const dpde_program* rate; /* null: no Courant number. Else see RolloutSetup::rate in dpde/runtime/rollout.h */
  double courant;
  const char* rate_field;    /* computed by `rate` */
  const dpde_program* trial; /* null: steps have no tolerance. Else see RolloutSetup::trial */
  dpde_step_control control;
  int32_t state_count;
  const dpde_source* states; /* has_formula: the initial state has one */
  int32_t coefficient_count;
  const dpde_coefficient* coefficients;
  int32_t noise_count;
  const dpde_noise* noises;
  int32_t network_count;
  const dpde_network* const* networks; /* the networks of its programs */
  const double* const* weights; /* initial weights of each; null: from initial_weights() of dpde/runtime/network.h */
  int32_t sought_count;
  const char* const* sought;   /* coefficients that are unknowns, or whose formulas contain one: the adjoints compute
                                  their derivatives */
  const dpde_program* program; /* one step */
  const dpde_program* adjoint; /* null without a task, as others that do not apply */
  int32_t adjoint_variant_count;
  const dpde_adjoint_variant* adjoint_variants;
  const dpde_program* initial;         /* computes the states that have a formula */
  const dpde_program* initial_adjoint; /* reads the adjoints of the states; its sums are adjoints of parameters */
  const dpde_program* coefficient_formulas;
  const dpde_program* coefficient_adjoint; /* as initial_adjoint */
  const dpde_program* start;               /* computes the unknown fields with DPDE_START_FORMULA */
  const dpde_program* observe;             /* its sums have the names of the observables */
  const dpde_program* output_program;      /* null: no output has a formula */
  int32_t output_count;
  const dpde_output* outputs; /* with a formula */
  int32_t datum_count;
  const dpde_datum* data;
  int32_t loss_count;
  const dpde_loss* losses;
  int32_t unknown_count;
  const dpde_unknown* unknowns; /* initial states, coefficients, parameters, controls, weights of networks: in the order
                                   of the vector of unknowns */
  dpde_optimiser optimiser;
  const char* no_second; /* why programs of second derivatives are missing; null: none is */
  dpde_second second, initial_second, coefficient_second; /* of the step and of the formulas */
  int32_t put_in_count;
  const dpde_put_in* put_in;
  int32_t unit_count;
  const dpde_unit* units;      /* where declared */
  const dpde_program* watched; /* null: no gradient depends on such assumptions */
  /* `program` (or `trial`) with more states: these become 1 if a watched value is below 0 in a stage, and if it is
   * above. null: the step contains no watched value */
  const dpde_program* watched_step;
  int32_t watched_count;
  const dpde_watched* watched_values;
} dpde_scene;

#ifdef __cplusplus
}
#endif
#endif
