/* SPDX-License-Identifier: Apache-2.0 */
/* A compiled scene, and its task, as plain C data: programs (kernel_abi.h) and the numbers they run with. Compiled in
 * memory or ahead of time, it looks the same to dpde::Simulation (dpde/runtime/simulation.h).
 */
#ifndef DPDE_SCENE_ABI_H
#define DPDE_SCENE_ABI_H

#include "dpde/kernel_abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define DPDE_SCENE_VERSION 15

typedef struct dpde_axis {
  const char* name;
  double low, high;
  int64_t cells; /* as the scene says; the programs run on any number */
  int32_t is_periodic;
  const double* centres; /* null: uniform. Of an axis that is stretched or runs down, whose programs run on as many
                            cells as the scene says */
} dpde_axis;

typedef struct dpde_value {
  const char* name;
  double value;
  int32_t is_fixed; /* the grid, times and the like were made of it: no other value can be given */
} dpde_value;

/* A parameter (also among the params) with values[n / every] in step n, the last one beyond. */
typedef struct dpde_control {
  const char* name;
  int32_t every, count;
  const double* values; /* of an unknown those its task begins with */
} dpde_control;

/* A field. has_formula 0: nobody but the host knows its values. */
typedef struct dpde_source {
  const char* name;
  int32_t has_formula;
} dpde_source;

/* A field that is given. every > 0: a control field, one after the other for each of `count` intervals of so many
 * steps. Its formula is then a program of its own, run for each interval with t in the middle of it. */
typedef struct dpde_coefficient {
  const char* name;
  int32_t has_formula; /* of an unknown control field: where it begins */
  int32_t every, count;
  const dpde_program* formula; /* keeps the field; null: in coefficient_formulas */
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

/* Values that losses compare with, given by the host: one state for each instant; count 0: one for all of them. */
typedef struct dpde_datum {
  const char* name;
  dpde_instants at;
  int32_t is_number; /* each state is one number, in all cells the same */
} dpde_datum;

/* For products of second derivatives: a tangent and the adjoint of that. All tangents of a scene call the rate of a
 * value alike. */
typedef struct dpde_second {
  const dpde_program* tangent;
  const dpde_program* adjoint;
} dpde_second;

typedef struct dpde_loss {
  const dpde_program* loss; /* its one sum is the loss */
  const dpde_program* adjoint;
  dpde_instants at;
  dpde_second full;    /* null programs: nothing that is sought reaches it, or see dpde_scene::no_second */
  dpde_second squares; /* the same with the squares of the residuals' rates, for Gauss-Newton; null: the loss is no sum
                          of squares */
  const char*
      average; /* what the states give adds up to this parameter of losses of averages, and is no loss; or null */
  int32_t of_averages; /* made of such parameters, once a run; `at` is empty */
  double weight;       /* times what each state gives */
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
  int32_t start;    /* of a field: that of the scene, by the program `start`, or given by the host */
  double low, high; /* infinite: no bounds */
} dpde_unknown;

enum { DPDE_GRADIENT_DESCENT = 0, DPDE_ADAM = 1, DPDE_LBFGS = 2, DPDE_NEWTON_CG = 3 };
typedef struct dpde_optimiser {
  int32_t method;
  double rate;          /* of gradient descent and Adam */
  int32_t gauss_newton; /* of Newton's method: in place of the full Hessian */
  int32_t iterations;
} dpde_optimiser;

/* order: the error that `trial` estimates is step^order for small steps. first: the length of the first part of steps
 * that is tried. */
typedef struct dpde_step_control {
  int32_t order;
  double first;
} dpde_step_control;

/* The formula of `name`, a coefficient or an initial state, is part of that of `in`, which does not follow values that
 * the host gives `name`. */
typedef struct dpde_put_in {
  const char* name;
  const char* in;
} dpde_put_in;

/* What a formula divides by, or on which side of a switch it is, in a field that `watched` keeps. A gradient lacks what
 * a change of it adds: of the sign in a cell, or of a switch at all. */
typedef struct dpde_watched {
  const char* field;
  const char *below, *above; /* states of `watched_step`; null: no step is made of it */
  const char *text, *help;   /* the subject of a sentence that says what it does; what to write instead */
  int32_t is_switch;
  int32_t begins_with_one_sign; /* it has to, in all cells, where formulas give what it is made of */
  int32_t loss;                 /* > 0: the number of that loss, counted from 1, in which alone it stands */
} dpde_watched;

/* As it is written: "m/s". */
typedef struct dpde_unit {
  const char* name; /* of a field, of a vector of each component, of a parameter, an observable, an axis, t */
  const char* unit;
} dpde_unit;

/* What is recorded beside states: an output with a formula. */
typedef struct dpde_output {
  const char* name;
  const char* field; /* that the program of outputs keeps */
} dpde_output;

typedef struct dpde_scene {
  int32_t version; /* DPDE_SCENE_VERSION */
  const char* name;
  const char* task; /* null: a scene without one */
  int32_t rank;
  dpde_axis axes[DPDE_MAX_RANK];
  double t_begin, step;
  int32_t steps;
  double steady; /* > 0: the run ends where no state changes by more a unit of time; see RolloutSetup::steady in
                    dpde/runtime/rollout.h */
  int32_t param_count;
  const dpde_value* params; /* an unknown has the value its task begins with */
  int32_t control_count;
  const dpde_control* controls;
  const dpde_program* rate; /* null: steps are made whole. Else see RolloutSetup::rate in dpde/runtime/rollout.h */
  double courant;
  const char* rate_field;    /* that `rate` keeps */
  const dpde_program* trial; /* null: steps have no tolerance. Else see RolloutSetup::trial */
  dpde_step_control control;
  int32_t state_count;
  const dpde_source* states; /* has_formula: of the initial state */
  int32_t coefficient_count;
  const dpde_coefficient* coefficients;
  int32_t noise_count;
  const dpde_noise* noises;
  int32_t network_count;
  const dpde_network* const* networks; /* those that programs apply */
  const double* const* weights; /* what each begins with; null: as initial_weights() of dpde/runtime/network.h says */
  int32_t sought_count;
  const char* const*
      sought; /* coefficients that are unknowns, or whose formulas hold one: the adjoints keep their derivatives */
  const dpde_program* program;       /* one step */
  const dpde_program* adjoint;       /* null without a task, as are the others that do not apply */
  const dpde_program* total_adjoint; /* see RolloutSetup::total_adjoint */
  const dpde_program* keeping_step;  /* see RolloutSetup::keeping_step */
  const dpde_program* kept_adjoint;
  const dpde_program* initial;         /* keeps the states that have a formula */
  const dpde_program* initial_adjoint; /* reads the adjoints of the states, has the sums of parameters */
  const dpde_program* coefficient_formulas;
  const dpde_program* coefficient_adjoint; /* as initial_adjoint */
  const dpde_program* start;               /* keeps the unknown fields with DPDE_START_FORMULA */
  const dpde_program* observe;             /* sums named as the observables are */
  const dpde_program* output_program;      /* null: no output has a formula */
  int32_t output_count;
  const dpde_output* outputs; /* with a formula */
  int32_t datum_count;
  const dpde_datum* data;
  int32_t loss_count;
  const dpde_loss* losses;
  int32_t unknown_count;
  const dpde_unknown* unknowns; /* initial states, coefficients, parameters, controls, weights of networks: the order of
                                   the vector of all of them */
  dpde_optimiser optimiser;
  const char* no_second; /* why not all programs of second derivatives are there; null: they are */
  dpde_second second, initial_second, coefficient_second; /* of the step and of the formulas */
  int32_t put_in_count;
  const dpde_put_in* put_in;
  int32_t unit_count;
  const dpde_unit* units;      /* where they are known */
  const dpde_program* watched; /* null: no gradient hangs on what is taken for granted */
  /* `program` or, where there is one, `trial`, with more states: they become 1 where a value that is watched is below 0
   * in a stage, and where it is above. null: no step is made of what is watched */
  const dpde_program* watched_step;
  int32_t watched_count;
  const dpde_watched* watched_values;
} dpde_scene;

#ifdef __cplusplus
}
#endif
#endif
