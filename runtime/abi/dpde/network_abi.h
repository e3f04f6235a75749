/* SPDX-License-Identifier: Apache-2.0 */
/* Neural networks over the cells of a grid, as plain C data.
 *
 * A network maps `inputs` channels, each with a value in every interior cell, to `outputs` channels. Its layers are
 * in static single assignment: value 0 is the input, value k the result of layers[k-1], the last value the output.
 *
 * Every value has a level: its grid has ceil(cells / size) cells along each axis; `size` is the product of the
 * strides and pools that lead to it (upsampling divides it). Size 1 is the grid of the scene.
 *
 * A network with is_host has no layers: the program that runs the scene computes it (dpde_host_network). */
#ifndef DPDE_NETWORK_ABI_H
#define DPDE_NETWORK_ABI_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* DPDE_CONV: r[o](p) = bias[o] + sum over i, k of w[o][i][k] * v[i](stride*p + dilation*(k - extent/2)), k over the
 * cube of extent^rank offsets (extent odd), i over the input channels of o's group. Weights:
 * [channels][channels_in/groups][z][y][x], then, with a bias, [channels]. A dense layer has extent 1. Points outside
 * of the grid: see padding. DPDE_ACTIVATE: r = f(v). DPDE_SCALE: r = factor * v. DPDE_ADD: r = v + other.
 * DPDE_CONCAT: channels of v, then of other. DPDE_MEAN_POOL, DPDE_MAX_POOL: over the `stride`^rank cells stride*p +
 * 0 .. stride-1 (fewer at an end that stride does not divide); the gradient of max goes to the first of the largest.
 * DPDE_UPSAMPLE: r(p) = v(floor(p / stride)), onto the grid that is `stride` times finer. DPDE_FIX_SUM: r[c] = v[c]
 * + (factor - sum over channels of v) / channels: the channels add up to `factor`. DPDE_REORIENT: r[c](p) = s *
 * v[|order[c]| - 1](q), s the sign of order[c]; q along axis |axes[a]| - 1 is p along a, counted from the other end
 * if axes[a] is negative. `axes` is a permutation of axes with equal numbers of cells; `order` null: channels
 * unchanged. */
enum {
  DPDE_CONV = 0,
  DPDE_ACTIVATE = 1,
  DPDE_SCALE = 2,
  DPDE_ADD = 3,
  DPDE_CONCAT = 4,
  DPDE_MEAN_POOL = 5,
  DPDE_MAX_POOL = 6,
  DPDE_UPSAMPLE = 7,
  DPDE_FIX_SUM = 8,
  DPDE_REORIENT = 9
};
/* leaky_relu: v where v > 0, else factor*v. gelu: v/2*(1 + erf(v/sqrt(2))). softplus: log(1 + exp(v)). silu: v/(1 +
 * exp(-v)). The derivative of relu at 0 is 0, that of leaky_relu `factor`. */
enum {
  DPDE_RELU = 0,
  DPDE_LEAKY_RELU = 1,
  DPDE_GELU = 2,
  DPDE_TANH = 3,
  DPDE_SIGMOID = 4,
  DPDE_SOFTPLUS = 5,
  DPDE_SILU = 6
};
/* How weights of a convolution begin; biases begin with 0. fan_in = channels_in/groups*extent^rank, fan_out alike.
 * DPDE_HE: normal, deviation gain*sqrt(2/fan_in). DPDE_XAVIER: uniform within gain*sqrt(6/(fan_in + fan_out)). */
enum { DPDE_INIT_HE = 0, DPDE_INIT_XAVIER = 1, DPDE_INIT_ZERO = 2 };
/* Values of a convolution's input beyond the ends of an axis. DPDE_PAD_REPLICATE: the last cell. DPDE_PAD_REFLECT:
 * cell -1-k is k and n+k is n-1-k, repeatedly on grids narrower than the kernel. */
enum { DPDE_PAD_PERIODIC = 0, DPDE_PAD_ZERO = 1, DPDE_PAD_REPLICATE = 2, DPDE_PAD_REFLECT = 3 };

typedef struct dpde_layer {
  int32_t kind;
  int32_t input, other;                     /* indices of values; other: for DPDE_ADD and DPDE_CONCAT */
  int32_t channels;                         /* of the result */
  int32_t extent, stride, dilation, groups; /* of DPDE_CONV; stride also of pools and DPDE_UPSAMPLE */
  int32_t activation;
  double factor;         /* of DPDE_SCALE, DPDE_FIX_SUM, leaky_relu */
  int64_t weights, bias; /* index of the first among the weights of the network; several convolutions may share them;
                            bias -1: none */
  int32_t init;
  double gain;
  int32_t axes[3]; /* of DPDE_REORIENT */
  const int32_t* order;
} dpde_layer;

typedef struct dpde_network {
  const char* name;
  int32_t rank;
  int32_t real; /* DPDE_F64, DPDE_F32: type of its values and of the weights in computations */
  int32_t inputs, outputs;
  int32_t padding[3]; /* of each axis */
  int64_t weight_count;
  uint64_t seed; /* of its initial weights */
  int32_t layer_count;
  const dpde_layer* layers;
  int32_t is_host; /* 1: computed by the host; no layers, and weight_count weights that start with 0 */
} dpde_network;

/* Functions of the host for such a network. Arrays are dense: interior cells, channel after channel, x fastest. Both
 * functions set their results. vector_jacobian: transposed Jacobian at (`inputs`, `weights`) times `seeds`, which
 * have the shape of the outputs. */
typedef struct dpde_host_network {
  void* context;
  void (*value)(void* context, const double* inputs, const double* weights, double* outputs);
  void (*vector_jacobian)(void* context, const double* inputs, const double* weights, const double* seeds,
                          double* input_bars, double* weight_bars);
} dpde_host_network;

#ifdef __cplusplus
}
#endif
#endif
