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
 *  - Errors. A function that can fail has a last argument `error`, which may be NULL. If the function fails it sets
 *    *error; the caller owns that handle and frees it. The function returns DPDE_OK or the code of the error. A
 *    function that makes a handle returns NULL instead.
 *  - Handles may be freed in any order; NULL may be freed too. A dpde_sim is for one thread at a time. Several may run
 *    at once.
 *  - Arrays are doubles: the interior values alone, x fastest. Value (x, y, z) has the index x + nx*(y + ny*z). Values
 *    are copied from and to the caller's memory during the call; no pointer is kept.
 *  - A text that is returned belongs to the handle that was asked.
 *  - Versions. A program compiled with this header works with every library whose dpde_c_version() is at least
 *    DPDE_C_VERSION. A number never gets a second meaning.
 */
#ifndef DPDE_DPDE_C_H
#define DPDE_DPDE_C_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The version of this header. */
#define DPDE_C_VERSION 4

/* The version of the library. */
int32_t dpde_c_version(void);

/* Section: Errors */

/* Codes of errors. DPDE_OK: there is none. */
#define DPDE_OK 0
#define DPDE_ERROR_INPUT 1      /* an argument is wrong: a text, a name, a size */
#define DPDE_ERROR_RUN 2        /* the computation cannot go on */
#define DPDE_ERROR_MACHINE 3    /* memory, disk, operating system */
#define DPDE_ERROR_NOT_FINITE 4 /* a value of the run is not finite */
#define DPDE_ERROR_STOPPED 5    /* a progress function returned 0 */

/* A handle of an error. */
typedef struct dpde_error dpde_error;
/* One of the codes above. */
int32_t dpde_error_code(const dpde_error* error);
/* All messages as text for people, with source lines and carets. */
const char* dpde_error_text(const dpde_error* error);
/* The same for programs: a JSON array of {code, severity, message, file, line, column, hint}. It is empty if the error
 * is not in a .dpde text. */
const char* dpde_error_json(const dpde_error* error);
/* Frees the handle. */
void dpde_error_free(dpde_error* error);

/* Section: Models */

/* A handle of a .dpde text that has been checked. */
typedef struct dpde_model dpde_model;
/* Reads and checks a text, or a file; all of its scenes and tasks must be valid. `path` names the text in messages;
 * files that it loads are searched in the folder of `path`. Both return NULL after an error: DPDE_ERROR_INPUT for a
 * mistake in the text and for a file that cannot be read. */
dpde_model* dpde_model_from_text(const char* text, const char* path, dpde_error** error);
dpde_model* dpde_model_from_file(const char* path, dpde_error** error);
/* The name of the scene, or task, with this index, from 0; NULL beyond the last one. */
const char* dpde_model_scene(const dpde_model* model, size_t index);
const char* dpde_model_task(const dpde_model* model, size_t index);
/* Frees the handle. Its simulations remain valid. */
void dpde_model_free(dpde_model* model);

/* Section: Simulations */

/* Back ends: compiled in memory, by the system's C++ compiler, or interpreted. */
#define DPDE_BACKEND_JIT 0
#define DPDE_BACKEND_CPP 1
#define DPDE_BACKEND_INTERPRETER 2

/* As HostOptions of dpde.h. Lists end with NULL; NULL is an empty list. */
typedef struct {
  int32_t version;
  const char* name;          /* scene or task; NULL if there is just one */
  const char* scheme;        /* a scheme block of the text; NULL: the scene's */
  const char* const* set;    /* keys and values in turn: "cells", "64", "step", "1/256" */
  const char* const* inputs; /* of a scene: the inputs by which its end is differentiated; see DPDE_SEED */
  int32_t backend, threads, slots;
  int32_t force;        /* 1: run although the step is unstable */
  int32_t certify;      /* check of the derivatives: 1 on, 0 off, -1 if it is cheap */
  int32_t second_order; /* 1: for dpde_sim_hessian_vector() */
  int64_t checkpoint_bytes;
} dpde_options;

/* Sets the defaults: one thread, the JIT. `version` is DPDE_C_VERSION; only members of that version are written. */
void dpde_options_init(dpde_options* options, int32_t version);

/* A handle of a compiled scene or task. */
typedef struct dpde_sim dpde_sim;
/* Compiles a scene or a task to machine code. With a task or inputs it also compiles the derivative and checks it. NULL
 * after an error: DPDE_ERROR_INPUT for a name, a setting or a text that is wrong. */
dpde_sim* dpde_model_open(const dpde_model* model, const dpde_options* options, dpde_error** error);
/* Frees the handle. */
void dpde_sim_free(dpde_sim* sim);
/* The compiler's warnings, for people and as JSON like dpde_error_json(). "" if there is none. */
const char* dpde_sim_warnings_text(const dpde_sim* sim);
const char* dpde_sim_warnings_json(const dpde_sim* sim);
/* A sentence if the last run, loss or gradient ended with states far above their initial size, as with a step that is
 * too long; else "". The text is valid until the next run. */
const char* dpde_sim_growth(const dpde_sim* sim);

/* Section: Values */

/* Kinds of values. */
#define DPDE_PARAM 0    /* a parameter: one number */
#define DPDE_STATE 1    /* a state at the present time; names: the states */
#define DPDE_INITIAL 2  /* the state with which runs and losses start; names: the states */
#define DPDE_FIELD 3    /* a coefficient, a control field or data; can only be set */
#define DPDE_CONTROL 4  /* a control: one value for each interval */
#define DPDE_WEIGHTS 5  /* all weights of a network; names: the networks */
#define DPDE_UNKNOWN 6  /* of a task, or an input: the value with which gradients start; can only be read */
#define DPDE_GRADIENT 7 /* of the last gradient; names: the unknowns; can only be read */
#define DPDE_SEED 8     /* with inputs: the factor of a state at the end; names: the states; can only be set */
#define DPDE_OUTPUT 9   /* an output with a formula, at the present time; can only be read. Since version 4 */

/* The name with this index, from 0, of a kind; NULL beyond the last one. DPDE_CONTROL has no names. */
const char* dpde_sim_name(const dpde_sim* sim, int32_t kind, size_t index);
/* Sets *size to the number of values. DPDE_ERROR_INPUT: there is no such name. */
int32_t dpde_sim_size(dpde_sim* sim, int32_t kind, const char* name, size_t* size, dpde_error** error);
/* 1 for data that are one number at each time, of which DPDE_FIELD has one value for each time; else 0. Since version
 * 2. */
int32_t dpde_sim_is_number(const dpde_sim* sim, const char* name);
/* Copies `size` values to the simulation, or from it. DPDE_ERROR_INPUT: there is no such name, `size` is not that of
 * dpde_sim_size(), or the kind cannot be set or read. DPDE_ERROR_NOT_FINITE: a state is no longer finite; this is
 * reported once. */
int32_t dpde_sim_set(dpde_sim* sim, int32_t kind, const char* name, const double* values, size_t size,
                     dpde_error** error);
int32_t dpde_sim_get(dpde_sim* sim, int32_t kind, const char* name, double* to, size_t size, dpde_error** error);
/* Sets *value to an observable of the scene, at the present state. */
int32_t dpde_sim_observe(dpde_sim* sim, const char* name, double* value, dpde_error** error);

/* The number of axes, 0 to 3. */
size_t dpde_sim_rank(const dpde_sim* sim);
/* The number of cells along an axis (0: x); 0 if there is no such axis. */
size_t dpde_sim_cells(const dpde_sim* sim, size_t axis);
/* A unit, "m/s": of a field, a component of a vector, a parameter, an observable, an axis or t; "" if none is declared.
 * Since version 2. */
const char* dpde_sim_unit(const dpde_sim* sim, const char* name);
/* Copies the centres of the cells along an axis; `size` is dpde_sim_cells(). */
int32_t dpde_sim_coordinates(const dpde_sim* sim, size_t axis, double* to, size_t size, dpde_error** error);
/* The present time, the length of a step, and the number of steps made. */
double dpde_sim_time(const dpde_sim* sim);
double dpde_sim_time_step(const dpde_sim* sim);
int64_t dpde_sim_steps_done(const dpde_sim* sim);

/* Section: Runs */

/* What a progress function gets. */
typedef struct {
  int64_t done, total;        /* steps; of an optimiser: updates, 0 */
  double time;                /* of the present state; of an optimiser 0 */
  double loss, gradient_norm; /* of an optimiser, else 0 */
} dpde_report;
/* Returns 0 to stop: the call that runs then returns DPDE_ERROR_STOPPED. `user` is the pointer given to that call. */
typedef int32_t (*dpde_progress)(void* user, const dpde_report* report);

/* Makes the initial state the present one. */
int32_t dpde_sim_reset(dpde_sim* sim, dpde_error** error);
/* Makes `count` steps from the present state. */
int32_t dpde_sim_step(dpde_sim* sim, int32_t count, dpde_error** error);
/* Runs from the present state to the first step that ends at `until` or later; NAN: to the end of the scene.
 * `progress` is called every `every` steps; it may be NULL. DPDE_ERROR_NOT_FINITE: the run blew up. */
int32_t dpde_sim_run(dpde_sim* sim, double until, dpde_progress progress, void* user, int32_t every,
                     dpde_error** error);

/* Section: Records */

/* From now on steps and runs are recorded: the first state, the state after each step whose number is a multiple of
 * `every`, and the last one; with `every` 0 (since version 4) the outputs of the scene. dpde_sim_record_end() writes
 * the files that `dpde run --every N --out FOLDER` writes, also after an error of a run; pictures since version 4. A
 * record is of one run: runs after a reset are an error. Since version 3. */
int32_t dpde_sim_record(dpde_sim* sim, const char* folder, int32_t every, dpde_error** error);
int32_t dpde_sim_record_end(dpde_sim* sim, dpde_error** error);
/* Only during a record. The first writes a checkpoint to the folder after each step whose number is a multiple of
 * `steps`; 0: none. The second is called before any step: if the folder has a checkpoint of the same run, it sets
 * *found to 1 and the simulation to the state of the checkpoint. Since version 4. */
int32_t dpde_sim_record_checkpoints(dpde_sim* sim, int32_t steps, dpde_error** error);
int32_t dpde_sim_record_resume(dpde_sim* sim, int32_t* found, dpde_error** error);
/* Ends a record, if there is one, and writes nothing, as after a checkpoint that was refused. Since version 4. */
int32_t dpde_sim_record_drop(dpde_sim* sim, dpde_error** error);

/* Section: Losses and derivatives
 *
 * These functions need a task or inputs. They start from the initial state and do not change the present one. */

/* Sets *loss to the loss of the task. */
int32_t dpde_sim_loss(dpde_sim* sim, double* loss, dpde_error** error);
/* Sets *loss to the loss, or with inputs to the sum of seeds times states. Its gradient is stored: read it as
 * DPDE_GRADIENT. */
int32_t dpde_sim_gradient(dpde_sim* sim, double* loss, dpde_error** error);
/* The vector of all unknowns: their values one after the other, in the order of dpde_sim_name() for DPDE_UNKNOWN. The
 * first function gives its length, which `size` must be. */
size_t dpde_sim_unknown_count(const dpde_sim* sim);
int32_t dpde_sim_set_unknowns(dpde_sim* sim, const double* values, size_t size, dpde_error** error);
/* Sets `product` to the Hessian of the loss, or with `gauss_newton` 1 to the Gauss-Newton matrix, times `direction`,
 * both vectors of all unknowns. DPDE_ERROR_INPUT: the options did not have second_order, or there is no such matrix. */
int32_t dpde_sim_hessian_vector(dpde_sim* sim, const double* direction, double* product, size_t size,
                                int32_t gauss_newton, dpde_error** error);
/* From now on losses, gradients and products call `progress` every `every` steps; NULL ends this. */
int32_t dpde_sim_watch(dpde_sim* sim, dpde_progress progress, void* user, int32_t every, dpde_error** error);

/* The result of an optimiser. */
typedef struct {
  double loss;
  int32_t iterations, evaluations, hessian_products;
  const char* reason; /* why it ended; the text remains valid */
} dpde_optimised;
/* Runs the optimiser of the task from the present values of the unknowns. `iterations` > 0 replaces the number of the
 * task. If `progress` returns 0 this is no error: the unknowns have the values of the last update. */
int32_t dpde_sim_optimise(dpde_sim* sim, int32_t iterations, dpde_progress progress, void* user, dpde_optimised* result,
                          dpde_error** error);

#ifdef __cplusplus
}
#endif

#endif
