// SPDX-License-Identifier: Apache-2.0
// Halos in a wavefront: ends of rows, rows and planes beyond walls, and finally those of the results.
#include "wavefront/wavefront_impl.h"

namespace dpde {

/// Fills the halo at the ends of a row. For a strip only at walls, since periodic strips compute the cells beyond their
/// ends.
void Wavefront::Impl::fill_ends(size_t number, size_t output, const Rings& rings, const Range& x,
                                const Place& place) const {
  const WavefrontLevel& level = plan.levels[number];
  const double* values = uniforms[static_cast<size_t>(level.uniforms)].data();
  char* row = row_of(level.outputs[output].stream, rings, place);
  const HaloFill& fill = fills[number][output];
  if (!splits_x) return fill.run_row(row, values);
  const int64_t n = layout.cells[0];
  for (int64_t k = 0; k < layout.halo[0]; ++k) {
    if (x.from == 0) fill.set_image(0, true, k, row + (-1 - k) * width, row + k * width, 1, values);
    if (x.to == n) fill.set_image(0, false, k, row + (n + k) * width, row + (n - 1 - k) * width, 1, values);
  }
}

/// Computes the halo row at position `to` along an axis from its mirror row `from`, whose ends must be filled.
void Wavefront::Impl::image_row(size_t number, Rings& rings, const Range& x, size_t axis, const Place& from,
                                int64_t to) const {
  const WavefrontLevel& level = plan.levels[number];
  const double* values = uniforms[static_cast<size_t>(level.uniforms)].data();
  Place target = from;
  target[axis] = to;
  const int64_t first = x.from == 0 ? -layout.halo[0] : x.from,
                end = x.to == layout.cells[0] ? x.to + layout.halo[0] : x.to;
  for (size_t o = 0; o < level.outputs.size(); ++o) {
    const WavefrontLevel::Output& output = level.outputs[o];
    if (!output.fill) continue;
    const int64_t layer = to < 0 ? -1 - to : to - layout.cells[axis];
    const char* source = row_of(output.stream, rings, from) + first * width;
    char* image = row_of(output.stream, rings, target) + first * width;
    fills[number][o].set_image(axis, to < 0, layer, image, source, end - first, values);
  }
}

/// Fills the rows (planes) beyond the walls of the last axis: those below together with their mirror row, those above
/// once all rows exist.
void Wavefront::Impl::image_slab(size_t number, Rings& rings, Tile region, int64_t slab) const {
  if (!is_bounded(last)) return;
  const int64_t n = layout.cells[last];
  if (last == 2 && is_bounded(1)) {
    if (region[1].from == 0) region[1].from -= layout.halo[1];
    if (region[1].to == layout.cells[1]) region[1].to += layout.halo[1];
  }
  const auto image = [&](int64_t from, int64_t to) {
    if (last == 1) return image_row(number, rings, region[0], 1, {0, from, 0}, to);
    for (int64_t y = region[1].from; y < region[1].to; ++y) image_row(number, rings, region[0], 2, {0, y, from}, to);
  };
  if (slab < layout.halo[last]) image(slab, -1 - slab);
  for (int64_t k = 0; slab == n - 1 && k < layout.halo[last]; ++k) image(n - 1 - k, n + k);
}

/// Fills the halos of the results that need rows or ends of other tiles.
void Wavefront::Impl::finish() const {
  for (size_t number = 0; number < plan.levels.size(); ++number) {
    const double* values = uniforms[static_cast<size_t>(plan.levels[number].uniforms)].data();
    for (size_t o = 0; o < plan.levels[number].outputs.size(); ++o) {
      const WavefrontLevel::Output& output = plan.levels[number].outputs[o];
      const bool is_copied = output.copied >= 0;
      if ((output.stream.kind != Kind::result && !is_copied) || !output.fill) continue;
      void* base = results[static_cast<size_t>(is_copied ? output.copied : output.stream.index)];
      if (splits_x || is_copied) {
        fills[number][o].run_plain(base, values, team);
      } else {
        fills[number][o].run_y(base, values, team);
        fills[number][o].run_z(base, values, team);
      }
    }
  }
}

}  // namespace dpde
