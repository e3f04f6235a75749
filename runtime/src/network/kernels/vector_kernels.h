// SPDX-License-Identifier: Apache-2.0
// The kernels of kernels.h with vectors of `Bytes`, for a machine with `Registers` vector registers. Files that include
// this must follow the rules of vector_math.h.
//
// A convolution keeps `width` channels times some vectors of cells in registers over the whole sum: each weight is
// loaded once for all of these vectors, each input once for all of these channels. A weight gradient keeps channels
// times terms.
#pragma once

#include "dpde/network_abi.h"
#include "network/kernels/kernels.h"
#include "network/kernels/vector_math.h"

namespace dpde::nn {
namespace {

template <class Real, int Bytes, int Registers>
struct Code {
  using M = Maths<Real, Bytes>;
  using T = typename M::T;
  using V = typename M::V;
  using Anywhere = typename T::Anywhere;
  static constexpr int lanes = T::lanes, widest = Registers >= 32 ? 8 : 4;
  static constexpr int64_t line = 64 / sizeof(Real);

  static V load(const Real* at) { return *reinterpret_cast<const Anywhere*>(at); }
  static void store(Real* at, V value) { *reinterpret_cast<Anywhere*>(at) = value; }
  /// Otherwise g++ loads it again for each use (weight gradients: 1.5 times as fast with one load).
  static void keep_in_register([[maybe_unused]] V& value) {
#if defined(__x86_64__)
    asm("" : "+v"(value));
#endif
  }
  static int64_t vectors_of(int64_t cells) { return (cells + lanes - 1) / lanes; }

  /// Number of vectors (terms) that a block of this width processes together: all fit in the registers, and there are
  /// enough independent sums.
  static constexpr int most(int width) {
    if (Registers >= 32) return width == 8 ? 3 : width == 4 ? 6 : 8;
    return width == 4 ? 3 : 4;
  }
  /// Size of the next piece of `count`, if pieces of at most `limit` have about equal size.
  static int64_t piece(int64_t count, int64_t limit) {
    const int64_t pieces = (count + limit - 1) / limit, even = (count + pieces - 1) / pieces;
    return even == 5 ? 4 : even == 7 ? 6 : even;
  }

  template <int32_t K>
  struct Kind {
    static constexpr int32_t value = K;
  };
  /// Calls `f(Kind)`, so that loops over cells know the kind at compile time.
  template <class F>
  static void with_kind(int32_t kind, const F& f) {
    switch (kind) {
      case DPDE_RELU: return f(Kind<DPDE_RELU>{});
      case DPDE_LEAKY_RELU: return f(Kind<DPDE_LEAKY_RELU>{});
      case DPDE_GELU: return f(Kind<DPDE_GELU>{});
      case DPDE_TANH: return f(Kind<DPDE_TANH>{});
      case DPDE_SIGMOID: return f(Kind<DPDE_SIGMOID>{});
      case DPDE_SOFTPLUS: return f(Kind<DPDE_SOFTPLUS>{});
      default: return f(Kind<DPDE_SILU>{});
    }
  }

  [[gnu::always_inline]] static V activated(int32_t kind, Real factor, V v) {
    switch (kind) {
      case DPDE_RELU: return v < 0 ? V{} : v;
      case DPDE_LEAKY_RELU: return v > v * factor ? v : v * factor;
      case DPDE_GELU: return v * M::normal(v).below;
      case DPDE_TANH: return M::tanh(v);
      case DPDE_SIGMOID: return M::sigmoid(v);
      case DPDE_SOFTPLUS: return M::softplus(v);
      case DPDE_SILU: return v * M::sigmoid(v);
      default: return v;
    }
  }
  [[gnu::always_inline]] static V derivative(int32_t kind, Real factor, V v) {
    const V one = M::all(1);
    switch (kind) {
      case DPDE_RELU: return v > 0 ? one : V{};
      case DPDE_LEAKY_RELU: return v > v * factor ? one : M::all(factor);
      case DPDE_GELU: {
        const auto normal = M::normal(v);
        return normal.below + v * normal.density;
      }
      case DPDE_SOFTPLUS: return M::sigmoid(v);
      case DPDE_SILU: {
        const V e = M::exp(-v), s = one / (one + e);
        return s * (one + v * (e * s));
      }
      case DPDE_TANH: return derivative_of_result(kind, factor, M::tanh(v));
      default: return derivative_of_result(kind, factor, M::sigmoid(v));
    }
  }
  [[gnu::always_inline]] static V derivative_of_result(int32_t kind, Real factor, V r) {
    const V one = M::all(1);
    switch (kind) {
      case DPDE_RELU: return r > 0 ? one : V{};
      case DPDE_LEAKY_RELU: return r > 0 ? one : M::all(factor);
      case DPDE_TANH: return one - r * r;
      default: return r * (one - r);
    }
  }

  /// f''; 0 for the piecewise linear kinds.
  [[gnu::always_inline]] static V bend(int32_t kind, V v) {
    const V one = M::all(1), two = M::all(2);
    switch (kind) {
      case DPDE_RELU:
      case DPDE_LEAKY_RELU: return V{};
      case DPDE_GELU: return (two - v * v) * M::normal(v).density;
      case DPDE_SOFTPLUS: {
        const V e = M::exp(-v), s = one / (one + e);
        return s * (e * s);
      }
      case DPDE_SILU: {
        const V e = M::exp(-v), s = one / (one + e), rest = e * s;
        return s * rest * (two + v * (rest - s));
      }
      case DPDE_TANH: return bend_of_result(kind, M::tanh(v));
      default: return bend_of_result(kind, M::sigmoid(v));
    }
  }
  [[gnu::always_inline]] static V bend_of_result(int32_t kind, V r) {
    const V one = M::all(1);
    switch (kind) {
      case DPDE_RELU:
      case DPDE_LEAKY_RELU: return V{};
      case DPDE_TANH: return (r + r) * (r * r - one);
      default: return r * (one - r) * (one - (r + r));
    }
  }

  /// Pointers of the vectors of a tile, and the steps between vectors.
  struct Place {
    const Real* input;
    Real* output;
    const Real* base;
    int64_t input_step, output_step, base_step;
  };

  template <int Width, int Count>
  [[gnu::noinline]] static void tile(const ConvolveCall<Real>& call, const Block& block, const Place& place) {
    const Real* const input = place.input;
    Real* const output = place.output;
    const int64_t input_step = place.input_step, output_step = place.output_step;
    V sums[Width][Count];
#pragma GCC unroll 8
    for (int c = 0; c < Width; ++c) {
#pragma GCC unroll 8
      for (int v = 0; v < Count; ++v) {
        sums[c][v] = call.bias ? M::all(call.bias[block.first + c]) : V{};
        if (place.base) sums[c][v] += load(place.base + c * call.base_plane + v * place.base_step);
      }
    }
    const Real* weights = call.weights + block.weights;
    const int64_t *term = call.offsets, *const end = term + call.terms;
    for (; term != end; ++term, weights += Width) {
      const Real* const at = input + *term;
      V values[Count];
#pragma GCC unroll 8
      for (int v = 0; v < Count; ++v) values[v] = load(at + v * input_step);
#pragma GCC unroll 8
      for (int c = 0; c < Width; ++c) {
        const V weight = M::all(weights[c]);
#pragma GCC unroll 8
        for (int v = 0; v < Count; ++v) sums[c][v] += weight * values[v];
      }
    }
#pragma GCC unroll 8
    for (int c = 0; c < Width; ++c) {
#pragma GCC unroll 8
      for (int v = 0; v < Count; ++v) store(output + c * call.output_plane + v * output_step, sums[c][v]);
    }
  }

  /// Processes `count` vectors from a position on.
  template <int Width>
  static void tiles(const ConvolveCall<Real>& call, const Block& block, Place place, int64_t count) {
    while (count > 0) {
      const int64_t n = piece(count, most(Width));
      switch (n) {
        case 1: tile<Width, 1>(call, block, place); break;
        case 2: tile<Width, 2>(call, block, place); break;
        case 3: tile<Width, 3>(call, block, place); break;
        case 4:
          if constexpr (most(Width) >= 4) tile<Width, 4>(call, block, place);
          break;
        case 6:
          if constexpr (most(Width) >= 6) tile<Width, 6>(call, block, place);
          break;
        default:
          if constexpr (most(Width) >= 8) tile<Width, 8>(call, block, place);
          break;
      }
      if (call.activation >= 0) finish(call, Width, place.output, n, place.output_step);
      count -= n;
      place.input += n * place.input_step;
      place.output += n * place.output_step;
      if (place.base) place.base += n * place.base_step;
    }
  }
  static void finish(const ConvolveCall<Real>& call, int64_t width, Real* output, int64_t count, int64_t step) {
    const Real factor = call.factor;
    const int64_t plane = call.output_plane;
    with_kind(call.activation, [=](auto kind) {
      for (int64_t c = 0; c < width; ++c) {
        for (int64_t v = 0; v < count; ++v) {
          Real* const at = output + c * plane + v * step;
          store(at, activated(kind.value, factor, load(at)));
        }
      }
    });
  }

  static void blocks(const ConvolveCall<Real>& call, int64_t x, int64_t y, int64_t z, int64_t count, bool along_y) {
    const Real* const input = call.input + call.first_x + x + (call.first[0] + y) * call.input_stride[0] +
                              (call.first[1] + z) * call.input_stride[1];
    Real* const output = call.output + x + y * call.output_stride[0] + z * call.output_stride[1];
    const Real* const base = call.base ? call.base + x + y * call.base_stride[0] + z * call.base_stride[1] : nullptr;
    for (const Block* block = call.blocks; block != call.blocks + call.block_count; ++block) {
      Place place{input + block->input,
                  output + block->first * call.output_plane,
                  base ? base + block->first * call.base_plane : nullptr,
                  lanes,
                  lanes,
                  lanes};
      if (along_y) {
        place.input_step = call.input_stride[0];
        place.output_step = call.output_stride[0];
        place.base_step = call.base_stride[0];
      }
      switch (block->width) {
        case 8:
          if constexpr (widest == 8) tiles<8>(call, *block, place, count);
          break;
        case 4: tiles<4>(call, *block, place, count); break;
        case 2: tiles<2>(call, *block, place, count); break;
        default: tiles<1>(call, *block, place, count); break;
      }
    }
  }

  static void convolve(const ConvolveCall<Real>& call, int64_t begin, int64_t end) {
    int64_t width = 1;
    for (int64_t b = 0; b < call.block_count; ++b) width = call.blocks[b].width > width ? call.blocks[b].width : width;
    const int64_t vectors = vectors_of(call.cells), most_at_once = width == 8   ? most(8)
                                                                   : width == 4 ? most(4)
                                                                   : width == 2 ? most(2)
                                                                                : most(1);
    for (int64_t row = begin; row < end;) {
      const int64_t y = row % call.rows_y, z = row / call.rows_y;
      if (vectors == 1) {  // narrow: several rows together
        const int64_t left = end - row < call.rows_y - y ? end - row : call.rows_y - y;
        const int64_t together = left < 24 ? left : 24;  // a whole number of tiles of every width
        blocks(call, 0, y, z, together, true);
        row += together;
        continue;
      }
      for (int64_t v = 0; v < vectors;) {
        const int64_t n = piece(vectors - v, most_at_once);
        blocks(call, v * lanes, y, z, n, false);
        v += n;
      }
      ++row;
    }
  }

  static Real total(V v) {
    Real sum = 0;
    for (int l = 0; l < lanes; ++l) sum += v[l];
    return sum;
  }

  /// Sums of neighbouring lanes, first those of a, then those of b.
  static V pair_sums(V a, V b) {
    typename T::B even{}, odd{};
    for (int l = 0; l < lanes; ++l) {
      even[l] = 2 * l;
      odd[l] = 2 * l + 1;
    }
    return __builtin_shuffle(a, b, even) + __builtin_shuffle(a, b, odd);
  }
  /// The total of all lanes of each of `Count` vectors.
  template <int Count>
  [[gnu::always_inline]] static void add_lanes(V* vectors, Real* totals) {
#pragma GCC unroll 8
    for (int first = 0; first < Count; first += lanes) {
      V group[lanes];
#pragma GCC unroll 16
      for (int k = 0; k < lanes; ++k) group[k] = first + k < Count ? vectors[first + k] : V{};
#pragma GCC unroll 8
      for (int left = lanes / 2; left > 0; left /= 2) {
#pragma GCC unroll 16
        for (int k = 0; k < left; ++k) group[k] = pair_sums(group[2 * k], group[2 * k + 1]);
      }
      store(totals + first, group[0]);
    }
  }

  /// Cells over which a gradient is summed before it is added to doubles.
  struct Piece {
    int64_t begin, end;  // rows
    int64_t first_x, vectors;
  };

  template <int Width, int Count>
  [[gnu::noinline]] static void gradient_tile(const WeightGradientCall<Real>& call, const Block& block,
                                              int64_t first_term, const Piece& piece) {
    V sums[Width][Count] = {};
    const Real* seeds = call.seeds + block.first * call.seed_plane + piece.first_x;
    const Real* values = call.values + block.input + piece.first_x;
    const int64_t vectors = piece.vectors, seed_plane = call.seed_plane;
    int64_t offsets[Count];
    for (int t = 0; t < Count; ++t) offsets[t] = call.offsets[first_term + t];
    int64_t y = piece.begin % call.rows_y;
    const int64_t z = piece.begin / call.rows_y;
    seeds += y * call.seed_stride[0] + z * call.seed_stride[1];
    values += y * call.value_stride[0] + z * call.value_stride[1];
    for (int64_t row = piece.begin; row < piece.end; ++row) {
      const Real *g = seeds, *v = values;
      for (const Real* const last = g + vectors * lanes; g != last; g += lanes, v += lanes) {
        V at[Count];
#pragma GCC unroll 8
        for (int t = 0; t < Count; ++t) at[t] = load(v + offsets[t]);
#pragma GCC unroll 8
        for (int c = 0; c < Width; ++c) {
          V seed = load(g + c * seed_plane);
          keep_in_register(seed);
#pragma GCC unroll 8
          for (int t = 0; t < Count; ++t) sums[c][t] += seed * at[t];
        }
      }
      seeds += call.seed_stride[0];
      values += call.value_stride[0];
      if (++y == call.rows_y) {
        y = 0;
        seeds += call.seed_stride[1] - call.rows_y * call.seed_stride[0];
        values += call.value_stride[1] - call.rows_y * call.value_stride[0];
      }
    }
    Real totals[(Width * Count + lanes - 1) / lanes * lanes];
    add_lanes<Width * Count>(&sums[0][0], totals);
    double* const bars = call.bars + block.first * call.terms + first_term;
    for (int c = 0; c < Width; ++c) {
      for (int t = 0; t < Count; ++t) bars[c * call.terms + t] += static_cast<double>(totals[c * Count + t]);
    }
  }

  template <int Width>
  static void gradient_terms(const WeightGradientCall<Real>& call, const Block& block, int64_t begin, int64_t end,
                             const Piece& part) {
    for (int64_t term = begin; term < end;) {
      const int64_t n = piece(end - term, most(Width));
      switch (n) {
        case 1: gradient_tile<Width, 1>(call, block, term, part); break;
        case 2: gradient_tile<Width, 2>(call, block, term, part); break;
        case 3: gradient_tile<Width, 3>(call, block, term, part); break;
        case 4:
          if constexpr (most(Width) >= 4) gradient_tile<Width, 4>(call, block, term, part);
          break;
        case 6:
          if constexpr (most(Width) >= 6) gradient_tile<Width, 6>(call, block, term, part);
          break;
        default:
          if constexpr (most(Width) >= 8) gradient_tile<Width, 8>(call, block, term, part);
          break;
      }
      term += n;
    }
  }

  static void gradient_block(const WeightGradientCall<Real>& call, const Block& block, int64_t begin, int64_t end,
                             const Piece& part) {
    switch (block.width) {
      case 8:
        if constexpr (widest == 8) gradient_terms<8>(call, block, begin, end, part);
        break;
      case 4: gradient_terms<4>(call, block, begin, end, part); break;
      case 2: gradient_terms<2>(call, block, begin, end, part); break;
      default: gradient_terms<1>(call, block, begin, end, part); break;
    }
  }
  /// In pieces of cells for which the seeds of a block stay in the first-level cache over all terms, and the values in
  /// the second-level cache over all blocks.
  static void weight_gradient(const WeightGradientCall<Real>& call, const Block* first, const Block* last,
                              int64_t begin, int64_t end) {
    const int64_t all = vectors_of(call.cells), fitting = 32 * 1024 / (8 * Bytes);
    const int64_t rows = all < fitting ? fitting / all : 1, vectors = all < fitting ? all : fitting;
    for (int64_t row = 0; row < call.rows; row += rows) {
      const int64_t end_row = row + rows < call.rows ? row + rows : call.rows;
      for (int64_t x = 0; x < all; x += vectors) {
        const Piece part{row, end_row, x * lanes, x + vectors < all ? vectors : all - x};
        for (const Block* block = first; block != last; ++block) gradient_block(call, *block, begin, end, part);
      }
    }
  }

  static void activate(int32_t kind, Real factor, const Real* values, Real* results, int64_t count) {
    with_kind(kind, [=](auto known) {
      for (int64_t i = 0; i < count; i += lanes) store(results + i, activated(known.value, factor, load(values + i)));
    });
  }
  static void activation_rate(int32_t kind, Real factor, const Real* values, const Real* rates, Real* results, bool add,
                              int64_t count) {
    with_kind(kind, [=](auto known) {
      for (int64_t i = 0; i < count; i += lanes) {
        const V rate = derivative(known.value, factor, load(values + i)) * load(rates + i);
        store(results + i, add ? load(results + i) + rate : rate);
      }
    });
  }
  static void rate_of_result(int32_t kind, Real factor, const Real* values, const Real* rates, Real* results, bool add,
                             int64_t count) {
    with_kind(kind, [=](auto known) {
      for (int64_t i = 0; i < count; i += lanes) {
        const V rate = derivative_of_result(known.value, factor, load(values + i)) * load(rates + i);
        store(results + i, add ? load(results + i) + rate : rate);
      }
    });
  }
  static void add_bend(int32_t kind, const Real* values, const Real* rates, const Real* seeds, Real* results,
                       int64_t count) {
    with_kind(kind, [=](auto known) {
      for (int64_t i = 0; i < count; i += lanes)
        store(results + i, load(results + i) + bend(known.value, load(values + i)) * load(rates + i) * load(seeds + i));
    });
  }
  static void add_bend_of_result(int32_t kind, const Real* values, const Real* rates, const Real* seeds, Real* results,
                                 int64_t count) {
    with_kind(kind, [=](auto known) {
      for (int64_t i = 0; i < count; i += lanes)
        store(results + i,
              load(results + i) + bend_of_result(known.value, load(values + i)) * load(rates + i) * load(seeds + i));
    });
  }
  static void scale(Real factor, const Real* values, Real* results, bool add, int64_t count) {
    for (int64_t i = 0; i < count; i += lanes) {
      const V value = load(values + i) * factor;
      store(results + i, add ? load(results + i) + value : value);
    }
  }
  static Real sum(const Real* values, int64_t count) {
    V sums{};
    for (int64_t i = 0; i < count; i += lanes) sums += load(values + i);
    return total(sums);
  }
};

template <class Real, int Bytes, int Registers>
Kernels<Real> kernels_of() {
  using C = Code<Real, Bytes, Registers>;
  return {C::widest,         C::convolve, C::weight_gradient,    C::activate, C::activation_rate,
          C::rate_of_result, C::add_bend, C::add_bend_of_result, C::scale,    C::sum};
}

}  // namespace
}  // namespace dpde::nn
