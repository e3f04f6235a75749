/* SPDX-License-Identifier: Apache-2.0
 * A rod that cools, from C: dpde/dpde_c.h is all that it knows. cc plain_c.c -ldpde -lm */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "dpde/dpde_c.h"

static const char* text =
    "model heat { field u; param kappa; dt(u) = kappa*lap(u) }\n"
    "scene rod : heat {\n"
    "  grid x = 0 .. 2*pi, cells 64, periodic\n"
    "  kappa = 0.1\n"
    "  initial u = 0\n"
    "  time 0 .. 1, step 1/64\n"
    "}\n";

static void check(const dpde_error* error) {
  if (error == NULL) return;
  fputs(dpde_error_text(error), stderr);
  exit(1);
}

static int32_t show(void* user, const dpde_report* now) {
  (void)user;
  printf("step %d of %d, t = %.2f\n", (int)now->done, (int)now->total, now->time);
  return 1;
}

int main(void) {
  double x[64], u[64], seed[64], slope, along = 0;
  const char* inputs[] = {"u", "kappa", NULL};
  dpde_error* error = NULL;
  dpde_options options;
  size_t i;
  dpde_model* model = dpde_model_from_text(text, "rod.dpde", &error);
  check(error);
  dpde_options_init(&options, DPDE_C_VERSION);
  options.name = "rod";
  options.inputs = inputs;
  dpde_sim* rod = dpde_model_open(model, &options, &error);
  check(error);
  dpde_sim_coordinates(rod, 0, x, 64, &error);
  for (i = 0; i < 64; ++i) u[i] = seed[i] = sin(x[i]);
  dpde_sim_set(rod, DPDE_INITIAL, "u", u, 64, &error);
  check(error);
  dpde_sim_run(rod, NAN, show, NULL, 32, &error); /* NAN: to the end */
  dpde_sim_get(rod, DPDE_STATE, "u", u, 64, &error);
  check(error);
  for (i = 0; i < 64; ++i) along += seed[i] * u[i] / 32;
  printf("amplitude %.4f, exp(-0.1) is %.4f\n", along, exp(-0.1));
  dpde_sim_set(rod, DPDE_SEED, "u", seed, 64, &error); /* the sum of sin(x)*u, differentiated by kappa */
  dpde_sim_gradient(rod, &along, &error);
  dpde_sim_get(rod, DPDE_GRADIENT, "kappa", &slope, 1, &error);
  check(error);
  printf("slope %.4f, -exp(-0.1) is %.4f\n", slope / 32, -exp(-0.1));
  dpde_sim_free(rod);
  dpde_model_free(model);
  return fabs(slope / 32 + exp(-0.1)) < 2e-3 ? 0 : 1;
}
