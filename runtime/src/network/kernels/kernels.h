// SPDX-License-Identifier: Apache-2.0
// Vectorised operations on whole rows of planes. The same source is compiled for several instruction sets
// (vector_kernels.h); `kernels` chooses at run time. All rows begin on 64 bytes and have space for whole vectors of 64
// bytes: lanes beyond the cells of a row are also written, with undefined values.
#pragma once

#include <stdint.h>

namespace dpde::nn {

/// Channels of the result computed together: 8, 4, 2 or 1.
struct Block {
  int64_t first, width;
  int64_t input;    // elements from the first plane that is read to the first plane of the group
  int64_t weights;  // begin of the block's weights: [term][width]
};

/// result[c](p) = bias[c] + base[c](p) + sum over terms t of weights[t][c] * input(p + offsets[t]), then the
/// activation.
template <class Real>
struct ConvolveCall {
  const Real* input;  // cell (0, 0, 0) of the first plane of the input
  Real* output;       // the first cell of the output range, in the first plane
  int64_t first_x;    // x of that cell, relative to `input`
  int64_t first[2];   // the same for y and z
  int64_t cells, rows_y;
  int64_t input_stride[2], output_stride[2];  // of y, z
  int64_t output_plane;
  const int64_t* offsets;
  int64_t terms;
  const Real* weights;
  const Real* bias;  // null: none
  const Real* base;  // initial values of the sums, for the same cells and channels; null: none
  int64_t base_plane, base_stride[2];
  const Block* blocks;
  int64_t block_count;
  int32_t activation;  // DPDE_RELU ..., -1: none
  Real factor;
};

/// bars[c][t] += sum over p of seeds[c](p) * values(p + offsets[t]). Seeds are 0 beyond the cells of a row.
template <class Real>
struct WeightGradientCall {
  const Real* seeds;
  const Real* values;
  int64_t cells, rows_y, rows;  // rows: all, of y and z
  int64_t seed_plane, seed_stride[2], value_stride[2];
  const int64_t* offsets;
  int64_t terms;
  double* bars;
};

template <class Real>
struct Kernels {
  int64_t widest_block;
  /// Rows begin .. end-1, numbered with y fastest, then z.
  void (*convolve)(const ConvolveCall<Real>& call, int64_t begin, int64_t end);
  /// Terms begin .. end-1 for the channels of the blocks.
  void (*weight_gradient)(const WeightGradientCall<Real>& call, const Block* first, const Block* last, int64_t begin,
                          int64_t end);
  void (*activate)(int32_t kind, Real factor, const Real* values, Real* results, int64_t count);
  /// results (+)= f'(values) * rates; for kinds with have_rate_of_result `values` may be results of f.
  void (*activation_rate)(int32_t kind, Real factor, const Real* values, const Real* rates, Real* results, bool add,
                          int64_t count);
  void (*rate_of_result)(int32_t kind, Real factor, const Real* values, const Real* rates, Real* results, bool add,
                         int64_t count);
  /// results += f''(values) * rates * seeds; for kinds with have_rate_of_result `values` may be results of f.
  void (*bend)(int32_t kind, const Real* values, const Real* rates, const Real* seeds, Real* results, int64_t count);
  void (*bend_of_result)(int32_t kind, const Real* values, const Real* rates, const Real* seeds, Real* results,
                         int64_t count);
  void (*scale)(Real factor, const Real* values, Real* results, bool add, int64_t count);
  Real (*sum)(const Real* values, int64_t count);
};

/// The kernels for this machine.
template <class Real>
const Kernels<Real>& kernels();

}  // namespace dpde::nn
