/* SPDX-License-Identifier: Apache-2.0
 * dpde_c.h compiled as C99 without extensions: values against closed forms; what is refused, by code, text and JSON.
 * A step of explicit Euler on a periodic rod scales sin(x) by g = 1 - 4 k dt/h^2 sin(h/2)^2. */
#include "dpde/dpde_c.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define CELLS 16

static int failures = 0;

static void expect(int holds, const char* what) {
  if (holds) return;
  ++failures;
  fprintf(stderr, "failed: %s\n", what);
}

static const char* text =
    "model heat { field u; param k; dt(u) = k*lap(u) }\n"
    "scheme ftcs { lap = central(2); time = euler }\n"
    "scene rod : heat with ftcs {\n"
    "  grid x = 0 .. 2*pi, cells 16, periodic\n"
    "  k = 0.3\n"
    "  initial u = sin(x)\n"
    "  observe size = mean(u^2)\n"
    "  time 0 .. 1, step 1/8\n"
    "}\n"
    "task find : rod {\n"
    "  unknown k from 0.25\n"
    "  unknown initial u\n"
    "  minimise mean(u^2) at t = 1\n"
    "  using lbfgs(), iterations 3\n"
    "}\n";

static double step_scale(double k) {
  const double h = 2 * acos(-1.0) / CELLS;
  return 1 - 4 * k * 0.125 / (h * h) * sin(h / 2) * sin(h / 2);
}

/* The code of the error, which is freed, and whether both texts hold something. */
static int32_t taken(dpde_error** error, const char* in_text, const char* in_json) {
  const int32_t code = dpde_error_code(*error);
  expect(strstr(dpde_error_text(*error), in_text) != NULL, in_text);
  expect(strstr(dpde_error_json(*error), in_json) != NULL, in_json);
  dpde_error_free(*error);
  *error = NULL;
  return code;
}

static dpde_sim* open_named(const dpde_model* model, const char* name, const char* const* inputs, dpde_error** error) {
  dpde_options options;
  dpde_options_init(&options, DPDE_C_VERSION);
  options.name = name;
  options.inputs = inputs;
  options.second_order = inputs == NULL && strcmp(name, "find") == 0;
  return dpde_model_open(model, &options, error);
}

static int32_t count(void* user, const dpde_report* now) {
  *(int*)user += 1;
  return now->done <= now->total || now->total == 0;
}
static int32_t stop(void* user, const dpde_report* now) {
  (void)user;
  return now->done < 0;
}

static void check_run(dpde_sim* rod) {
  double u[CELLS], x[CELLS], k = 0.2, size = 0;
  int calls = 0;
  dpde_error* error = NULL;
  expect(dpde_sim_rank(rod) == 1 && dpde_sim_cells(rod, 0) == CELLS && dpde_sim_cells(rod, 1) == 0, "the grid");
  expect(strcmp(dpde_sim_name(rod, DPDE_PARAM, 0), "k") == 0, "the parameter");
  expect(dpde_sim_name(rod, DPDE_STATE, 1) == NULL && dpde_sim_name(rod, 99, 0) == NULL, "there is one state");
  expect(dpde_sim_set(rod, DPDE_PARAM, "k", &k, 1, &error) == DPDE_OK, "set k");
  expect(dpde_sim_run(rod, NAN, count, &calls, 4, &error) == DPDE_OK && calls == 2, "run with progress");
  expect(dpde_sim_get(rod, DPDE_STATE, "u", u, CELLS, &error) == DPDE_OK, "get u");
  expect(dpde_sim_coordinates(rod, 0, x, CELLS, &error) == DPDE_OK, "coordinates");
  expect(fabs(u[3] - pow(step_scale(0.2), 8) * sin(x[3])) < 1e-14, "u is its closed form");
  expect(dpde_sim_observe(rod, "size", &size, &error) == DPDE_OK && fabs(size - pow(step_scale(0.2), 16) / 2) < 1e-14,
         "size is its closed form");
  expect(dpde_sim_unit(rod, "u")[0] == 0 && dpde_sim_unit(rod, NULL)[0] == 0 && dpde_sim_unit(NULL, "u")[0] == 0,
         "no unit");
  expect(dpde_sim_steps_done(rod) == 8 && dpde_sim_time(rod) == 1 && dpde_sim_time_step(rod) == 0.125, "time");
  expect(dpde_sim_reset(rod, &error) == DPDE_OK && dpde_sim_time(rod) == 0, "reset");
  expect(dpde_sim_run(rod, NAN, stop, NULL, 2, &error) == DPDE_ERROR_STOPPED, "progress stops a run");
  expect(taken(&error, "stopped", "[]") == DPDE_ERROR_STOPPED, "a stop has its code");
}

static void check_refusals(dpde_sim* rod) {
  double u[CELLS] = {0};
  size_t size = 0;
  dpde_error* error = NULL;
  expect(dpde_sim_set(rod, DPDE_PARAM, "q", u, 1, &error) == DPDE_ERROR_INPUT, "no parameter q");
  taken(&error, "no parameter q; it has k", "[]");
  expect(dpde_sim_get(rod, DPDE_STATE, NULL, u, CELLS, &error) == DPDE_ERROR_INPUT, "no name");
  expect(dpde_sim_get(rod, DPDE_STATE, "u", NULL, CELLS, NULL) == DPDE_ERROR_INPUT, "nowhere to put it");
  expect(dpde_sim_set(NULL, DPDE_STATE, "u", u, CELLS, NULL) == DPDE_ERROR_INPUT, "no simulation");
  expect(dpde_sim_gradient(NULL, NULL, NULL) == DPDE_ERROR_INPUT && dpde_sim_step(NULL, 1, NULL) == DPDE_ERROR_INPUT,
         "no simulation to run");
  expect(dpde_sim_name(NULL, DPDE_STATE, 0) == NULL && dpde_sim_rank(NULL) == 0 && dpde_model_scene(NULL, 0) == NULL,
         "nothing has no names");
  expect(strcmp(dpde_sim_warnings_text(rod), "") == 0 && strcmp(dpde_sim_warnings_json(rod), "[]") == 0, "no warnings");
  taken(&error, "no state", "[]");
  expect(dpde_sim_set(rod, DPDE_INITIAL, "u", u, 3, &error) == DPDE_ERROR_INPUT, "three values");
  taken(&error, "3", "[]");
  expect(dpde_sim_set(rod, DPDE_GRADIENT, "u", u, CELLS, NULL) == DPDE_ERROR_INPUT, "an error that nobody takes");
  expect(dpde_sim_set(rod, DPDE_SEED, "u", u, CELLS, &error) == DPDE_ERROR_INPUT, "no inputs, no seeds");
  taken(&error, "inputs", "[]");
  expect(dpde_sim_size(rod, DPDE_FIELD, "f", &size, &error) == DPDE_ERROR_INPUT, "no field f");
  taken(&error, "no coefficient or data field f", "[]");
  expect(dpde_sim_gradient(rod, u, &error) == DPDE_ERROR_INPUT, "no task");
  taken(&error, "task", "[]");
  u[5] = NAN;
  expect(dpde_sim_set(rod, DPDE_STATE, "u", u, CELLS, &error) == DPDE_OK, "values that are not finite");
  expect(dpde_sim_step(rod, 8, &error) == DPDE_OK, "a few steps do not look");
  expect(dpde_sim_get(rod, DPDE_STATE, "u", u, CELLS, &error) == DPDE_ERROR_NOT_FINITE, "but are found");
  taken(&error, "no longer finite", "[]");
}

static void check_gradient(const dpde_model* model) {
  double loss = 0, slope = 0, step = 1e-5, direction[CELLS + 1] = {0}, product[CELLS + 1], next = 0;
  int calls = 0;
  dpde_optimised done;
  dpde_error* error = NULL;
  dpde_sim* find = open_named(model, "find", NULL, &error);
  const double g = step_scale(0.25), rate = (step_scale(1) - 1) * 8 * pow(g, 15);
  expect(find != NULL && dpde_sim_unknown_count(find) == CELLS + 1, "the unknowns");
  expect(dpde_sim_get(find, DPDE_GRADIENT, "k", &slope, 1, NULL) == DPDE_ERROR_INPUT, "no gradient yet");
  expect(dpde_sim_watch(find, count, &calls, 4, &error) == DPDE_OK, "watch");
  expect(dpde_sim_gradient(find, &loss, &error) == DPDE_OK && fabs(loss - pow(g, 16) / 2) < 1e-14, "the loss");
  expect(calls > 0, "progress of a gradient");
  expect(dpde_sim_get(find, DPDE_GRADIENT, "k", &slope, 1, &error) == DPDE_OK && fabs(slope - rate) < 1e-13, "slope");
  expect(strcmp(dpde_sim_name(find, DPDE_UNKNOWN, 1), "k") == 0, "k is behind u");
  direction[CELLS] = 1;
  expect(dpde_sim_hessian_vector(find, direction, product, CELLS + 1, 0, &error) == DPDE_OK, "the product");
  expect(dpde_sim_growth(find)[0] == 0, "nothing grows");
  loss = 1000; /* 8 steps by -122: 5e16 times */
  dpde_sim_set(find, DPDE_PARAM, "k", &loss, 1, &error);
  expect(dpde_sim_loss(find, &loss, &error) == DPDE_OK && strstr(dpde_sim_growth(find), "u has grown from") != NULL,
         "a loss of what grows");
  loss = 0.25 + step;
  dpde_sim_set(find, DPDE_PARAM, "k", &loss, 1, &error);
  dpde_sim_gradient(find, &loss, &error);
  dpde_sim_get(find, DPDE_GRADIENT, "k", &next, 1, &error);
  expect(fabs((next - slope) / step - product[CELLS]) < 1e-3 * fabs(product[CELLS]), "the product is a difference");
  dpde_sim_watch(find, stop, NULL, 1, &error);
  expect(dpde_sim_gradient(find, &loss, &error) == DPDE_ERROR_STOPPED, "progress stops a gradient");
  taken(&error, "stopped", "[]");
  expect(dpde_sim_get(find, DPDE_GRADIENT, "k", &slope, 1, NULL) == DPDE_ERROR_INPUT, "none of a stopped one");
  dpde_sim_watch(find, NULL, NULL, 0, &error);
  expect(dpde_sim_optimise(find, 2, count, &calls, &done, &error) == DPDE_OK && done.iterations == 2, "two updates");
  expect(strlen(done.reason) > 0, "says why it ended");
  expect(dpde_sim_get(find, DPDE_GRADIENT, "k", &slope, 1, &error) == DPDE_OK, "the gradient of the last update");
  dpde_sim_watch(find, stop, NULL, 1, &error);
  dpde_sim_optimise(find, 2, NULL, NULL, &done, &error);
  expect(dpde_sim_get(find, DPDE_GRADIENT, "k", &slope, 1, NULL) == DPDE_ERROR_INPUT, "none where it was stopped");
  dpde_sim_free(find);
}

static void check_inputs(const dpde_model* model) {
  const char* inputs[] = {"u", "k", NULL};
  const char* unknown[] = {"nothing", NULL};
  double u[CELLS], seed[CELLS], by_u[CELLS], by_k = 0, value = 0, k = 0.2;
  int i;
  dpde_error* error = NULL;
  dpde_sim* rod = open_named(model, "rod", inputs, &error);
  const double g = step_scale(0.2), scale = pow(g, 8), rate = 8 * pow(g, 7) * (step_scale(1) - 1);
  for (i = 0; i < CELLS; ++i) u[i] = seed[i] = sin((i + 0.5) * 2 * acos(-1.0) / CELLS);
  expect(dpde_sim_gradient(rod, &value, &error) == DPDE_ERROR_INPUT, "the seed is not there");
  taken(&error, "u_seed", "[]");
  dpde_sim_set(rod, DPDE_PARAM, "k", &k, 1, &error);
  dpde_sim_set(rod, DPDE_INITIAL, "u", u, CELLS, &error);
  expect(dpde_sim_set(rod, DPDE_SEED, "u", seed, CELLS, &error) == DPDE_OK, "a seed");
  expect(dpde_sim_gradient(rod, &value, &error) == DPDE_OK && fabs(value - 8 * scale) < 1e-13, "seed times end");
  dpde_sim_get(rod, DPDE_GRADIENT, "u", by_u, CELLS, &error);
  dpde_sim_get(rod, DPDE_GRADIENT, "k", &by_k, 1, &error);
  expect(fabs(by_u[2] - scale * seed[2]) < 1e-14 && fabs(by_k - 8 * rate) < 1e-12, "transposed derivatives");
  dpde_sim_free(rod);
  expect(open_named(model, "rod", unknown, &error) == NULL, "an input that is not there");
  expect(taken(&error, "nothing is not known here", "\"code\":\"E0301\"") == DPDE_ERROR_INPUT, "is input");
  expect(open_named(model, "find", inputs, &error) == NULL, "inputs of a task");
  taken(&error, "inputs are of a scene", "[]");
}

int main(void) {
  dpde_error* error = NULL;
  dpde_options options;
  dpde_model* model = dpde_model_from_text(text, "rod.dpde", &error);
  dpde_sim* rod = open_named(model, "rod", NULL, &error);
  expect(dpde_c_version() == DPDE_C_VERSION, "the version");
  expect(strcmp(dpde_model_scene(model, 0), "rod") == 0 && dpde_model_scene(model, 1) == NULL, "one scene");
  expect(strcmp(dpde_model_task(model, 0), "find") == 0, "one task");
  check_run(rod);
  check_refusals(rod);
  check_gradient(model);
  check_inputs(model);
  dpde_sim_free(rod);
  dpde_options_init(&options, DPDE_C_VERSION + 1);
  expect(dpde_model_open(model, &options, &error) == NULL, "options of a later version");
  taken(&error, "version", "[]");
  dpde_model_free(model);
  expect(dpde_model_from_text("model a { field u; dt(u) = advekt(u) }", NULL, &error) == NULL, "a text with an error");
  expect(taken(&error, "text.dpde:1:28: error[E0302]", "\"line\":1,\"column\":28") == DPDE_ERROR_INPUT, "is input");
  expect(dpde_model_from_file("nowhere.dpde", &error) == NULL, "a file that is not there");
  taken(&error, "nowhere.dpde", "E0");
  expect(dpde_model_from_text(NULL, NULL, &error) == NULL, "no text");
  taken(&error, "NULL", "[]");
  dpde_error_free(NULL);
  dpde_model_free(NULL);
  dpde_sim_free(NULL);
  if (failures == 0) puts("passed");
  return failures == 0 ? 0 : 1;
}
