/* SPDX-License-Identifier: Apache-2.0
 * The compiler in a program of any language: C99, opaque handles, no exceptions. dpde.h is the same for C++.
 *
 *   dpde_error* error = NULL;
 *   dpde_model* model = dpde_model_from_file("heat.dpde", &error);
 *   dpde_options options;
 *   dpde_options_init(&options, DPDE_C_VERSION);
 *   options.name = "rod";
 *   dpde_sim* rod = dpde_model_open(model, &options, &error);
 *   dpde_sim_set(rod, DPDE_INITIAL, "u", values, 128, &error);
 *   dpde_sim_run(rod, NAN, NULL, NULL, 0, &error);
 *   dpde_sim_get(rod, DPDE_STATE, "u", values, 128, &error);
 *
 *  - What can fail has a last argument `error`, which may be NULL: where *error is set it is the caller's, and to be
 *    freed. Calls give DPDE_OK, or the code of that error; those that make a handle give NULL then.
 *  - Handles may be freed in any order, NULL too. One thread at a time may use a dpde_sim; several may run at once.
 *  - Arrays are doubles, interior values alone, x fastest: value (x, y, z) is number x + nx*(y + ny*z). Values are
 * copied from and to the caller's memory at once; nothing of it is kept.
 *  - Texts that are returned belong to the handle that they were asked of.
 *  - Versions: a program compiled with this header works with every library whose dpde_c_version() is not below
 *    DPDE_C_VERSION. Numbers are never given a second meaning.
 */
#ifndef DPDE_DPDE_C_H
#define DPDE_DPDE_C_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define DPDE_C_VERSION 4

int32_t dpde_c_version(void);

/* Of an error; DPDE_OK is no error. */
#define DPDE_OK 0
#define DPDE_ERROR_INPUT 1      /* what the caller gave is wrong: a text, a name, a length */
#define DPDE_ERROR_RUN 2        /* the computation cannot go on */
#define DPDE_ERROR_MACHINE 3    /* memory, disk, operating system */
#define DPDE_ERROR_NOT_FINITE 4 /* a value of the run is not finite */
#define DPDE_ERROR_STOPPED 5    /* progress said so */

typedef struct dpde_error dpde_error;
int32_t dpde_error_code(const dpde_error* error);
/* For people: all messages, with source lines and carets. */
const char* dpde_error_text(const dpde_error* error);
/* For programs: an array of {code, severity, message, file, line, column, hint}; empty where no text is at fault. */
const char* dpde_error_json(const dpde_error* error);
void dpde_error_free(dpde_error* error);

/* A text, all of whose scenes and tasks make sense. `path` names it in messages; files that it loads are looked for
 * beside it. */
typedef struct dpde_model dpde_model;
dpde_model* dpde_model_from_text(const char* text, const char* path, dpde_error** error);
dpde_model* dpde_model_from_file(const char* path, dpde_error** error);
/* The index-th, from 0; NULL behind the last. */
const char* dpde_model_scene(const dpde_model* model, size_t index);
const char* dpde_model_task(const dpde_model* model, size_t index);
void dpde_model_free(dpde_model* model);

#define DPDE_BACKEND_JIT 0
#define DPDE_BACKEND_CPP 1
#define DPDE_BACKEND_INTERPRETER 2

/* As HostOptions of dpde.h. Lists end with NULL; NULL is an empty one. */
typedef struct {
  int32_t version;
  const char* name;          /* scene or task; NULL where there is just one */
  const char* scheme;        /* NULL: the scene's */
  const char* const* set;    /* keys and values in turn: "cells", "64", "step", "1/256" */
  const char* const* inputs; /* of a scene, what its end is differentiated by; see DPDE_SEED */
  int32_t backend, threads, slots;
  int32_t force;        /* 1: run with a step that ruins the run */
  int32_t certify;      /* 1, 0; -1: where it is cheap */
  int32_t second_order; /* 1: dpde_sim_hessian_vector() */
  int64_t checkpoint_bytes;
} dpde_options;

/* One thread, the JIT. `version`: DPDE_C_VERSION; only what that version has is written. */
void dpde_options_init(dpde_options* options, int32_t version);

typedef struct dpde_sim dpde_sim;
/* Compiles: machine code, and of tasks and inputs its derivative, checked. */
dpde_sim* dpde_model_open(const dpde_model* model, const dpde_options* options, dpde_error** error);
void dpde_sim_free(dpde_sim* sim);
/* What the compiler warns of, "" where of nothing: for people, and for programs as dpde_error_json(). */
const char* dpde_sim_warnings_text(const dpde_sim* sim);
const char* dpde_sim_warnings_json(const dpde_sim* sim);
/* Where the last run, loss or gradient has left states far above where they began, as steps that are too large do: a
 * sentence; else "". It stays until the next one. */
const char* dpde_sim_growth(const dpde_sim* sim);

/* What names mean and values are of. */
#define DPDE_PARAM 0
#define DPDE_STATE 1    /* at the present time; names: the states */
#define DPDE_INITIAL 2  /* where runs and losses begin; names: the states */
#define DPDE_FIELD 3    /* a coefficient, a control field or data; to be set alone */
#define DPDE_CONTROL 4  /* one value an interval */
#define DPDE_WEIGHTS 5  /* names: the networks */
#define DPDE_UNKNOWN 6  /* of the task, or an input: the value that gradients begin with; to be read alone */
#define DPDE_GRADIENT 7 /* of the last gradient; names: the unknowns; to be read alone */
#define DPDE_SEED 8   /* with inputs: what the state at the end is multiplied by; names: the states; to be set alone */
#define DPDE_OUTPUT 9 /* with a formula, at the present time; to be read alone. Since version 4 */

/* The index-th name, NULL behind the last; there are none of DPDE_CONTROL. */
const char* dpde_sim_name(const dpde_sim* sim, int32_t kind, size_t index);
/* How many values it has. */
int32_t dpde_sim_size(dpde_sim* sim, int32_t kind, const char* name, size_t* size, dpde_error** error);
/* 1 of data that are one number a time, of which DPDE_FIELD has so many values. Since version 2. */
int32_t dpde_sim_is_number(const dpde_sim* sim, const char* name);
int32_t dpde_sim_set(dpde_sim* sim, int32_t kind, const char* name, const double* values, size_t size,
                     dpde_error** error);
int32_t dpde_sim_get(dpde_sim* sim, int32_t kind, const char* name, double* to, size_t size, dpde_error** error);
int32_t dpde_sim_observe(dpde_sim* sim, const char* name, double* value, dpde_error** error);

size_t dpde_sim_rank(const dpde_sim* sim);
/* Cells along the axis; 0 where there is none. */
size_t dpde_sim_cells(const dpde_sim* sim, size_t axis);
/* "m/s": of a field, a component of one, a parameter, an observable, an axis or t; "" where none is told. Since version
 * 2. */
const char* dpde_sim_unit(const dpde_sim* sim, const char* name);
/* Centres of cells along the axis. */
int32_t dpde_sim_coordinates(const dpde_sim* sim, size_t axis, double* to, size_t size, dpde_error** error);
double dpde_sim_time(const dpde_sim* sim);
double dpde_sim_time_step(const dpde_sim* sim);
int64_t dpde_sim_steps_done(const dpde_sim* sim);

typedef struct {
  int64_t done, total;        /* steps; of an optimiser: updates, 0 */
  double time;                /* of the state that is looked at; of an optimiser 0 */
  double loss, gradient_norm; /* of an optimiser, else 0 */
} dpde_report;
/* 0 stops: the call gives DPDE_ERROR_STOPPED. */
typedef int32_t (*dpde_progress)(void* user, const dpde_report* report);

int32_t dpde_sim_reset(dpde_sim* sim, dpde_error** error);
int32_t dpde_sim_step(dpde_sim* sim, int32_t count, dpde_error** error);
/* To the first step that ends at `until` or later; NAN: to the end of the scene. progress may be NULL; else it is
 * called every so many steps. */
int32_t dpde_sim_run(dpde_sim* sim, double until, dpde_progress progress, void* user, int32_t every,
                     dpde_error** error);

/* From now on steps and runs are recorded: the first state, that of each step whose number `every` divides, and the
 * last one; with every 0 (since version 4) the outputs of the scene. dpde_sim_record_end() writes what
 * `dpde run --every N --out FOLDER` writes, pictures too since version 4 (see dpde/recorder.h), also behind an error of
 * a run. One run: a reset is an error of what runs then. Since version 3. */
int32_t dpde_sim_record(dpde_sim* sim, const char* folder, int32_t every, dpde_error** error);
int32_t dpde_sim_record_end(dpde_sim* sim, dpde_error** error);
/* While it is recorded: a checkpoint in the folder behind each step whose number `steps` divides, 0: none; and, before
 * anything runs, *found = 1 where there is one of the same run, at which the simulation stands then. Since version 4.
 */
int32_t dpde_sim_record_checkpoints(dpde_sim* sim, int32_t steps, dpde_error** error);
int32_t dpde_sim_record_resume(dpde_sim* sim, int32_t* found, dpde_error** error);
/* Ends the record, if there is one, and writes nothing, as behind a checkpoint that is refused. Since version 4. */
int32_t dpde_sim_record_drop(dpde_sim* sim, dpde_error** error);

/* With a task or inputs. They start from the initial state and leave the present one as it is. */
int32_t dpde_sim_loss(dpde_sim* sim, double* loss, dpde_error** error);
/* The loss, or of inputs the sum of seeds times states; its gradient is kept: DPDE_GRADIENT. */
int32_t dpde_sim_gradient(dpde_sim* sim, double* loss, dpde_error** error);
/* Values of all unknowns, one after the other in the order of dpde_sim_name(sim, DPDE_UNKNOWN, ...). */
size_t dpde_sim_unknown_count(const dpde_sim* sim);
int32_t dpde_sim_set_unknowns(dpde_sim* sim, const double* values, size_t size, dpde_error** error);
/* The Hessian of the loss, or with gauss_newton 1 that matrix, times a vector of all unknowns. */
int32_t dpde_sim_hessian_vector(dpde_sim* sim, const double* direction, double* product, size_t size,
                                int32_t gauss_newton, dpde_error** error);
/* From now on losses, gradients and products call `progress` every so many steps; NULL ends it. */
int32_t dpde_sim_watch(dpde_sim* sim, dpde_progress progress, void* user, int32_t every, dpde_error** error);

typedef struct {
  double loss;
  int32_t iterations, evaluations, hessian_products;
  const char* reason; /* why it ended; a text that stays */
} dpde_optimised;
/* The task's own optimiser from the present values; iterations > 0 in place of the task's. Progress that says stop is
 * no error: the unknowns are those of the last update. */
int32_t dpde_sim_optimise(dpde_sim* sim, int32_t iterations, dpde_progress progress, void* user, dpde_optimised* result,
                          dpde_error** error);

#ifdef __cplusplus
}
#endif

#endif
