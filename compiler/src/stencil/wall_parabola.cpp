// SPDX-License-Identifier: Apache-2.0
#include "stencil/wall_parabola.h"

#include <cstdlib>

#include "stencil/build.h"

namespace dpde::stencil {

namespace {

class Parabolas {
 public:
  explicit Parabolas(const Lowering& lowering) : lowering_(lowering) {}

  Expr operator()(const Expr& e) const {
    const Access* access = std::get_if<Access>(&e->kind);
    return access ? along(access->field, access->offset, lowering_.rank() - 1) : map_children(e, *this);
  }

 private:
  /// Whether the side that the offset leads to has a value halfway between two points of the field.
  bool has_value(const std::string& field, int axis, bool is_low) const {
    const model::State* state = lowering_.state_beyond_walls(field);
    const auto a = static_cast<std::size_t>(axis);
    if (!state || lowering_.problem().axes[a].topology == Topology::periodic || state->placement[a]) return false;
    return (is_low ? state->boundary[a].low : state->boundary[a].high).kind == SideKind::value;
  }

  /// The field at `offset`, by parabolas across the walls of the axes up to `axis`. Halos are filled along one axis
  /// after the other: only the mean of the last one's image and what it was filled from is the wall's value, and that
  /// is what the parabola goes through.
  Expr along(const std::string& field, const Offset& offset, int axis) const {
    if (axis < 0) return access(field, offset);
    const auto a = static_cast<std::size_t>(axis);
    const int away = offset[a], inwards = away < 0 ? 1 : -1;
    const Expr image = along(field, offset, axis - 1);
    if (away == 0 || !has_value(field, axis, away < 0)) return image;
    const auto moved = [&](int by) {
      Offset to = offset;
      to[a] += inwards * by;
      return to;
    };
    const auto is_inside = [&](int by) {
      Offset to{};
      to[a] = moved(by)[a];
      return inside(to, 0);
    };
    Expr result = image;
    for (int m = std::abs(away) - 1; m >= 0; --m) {  // the point is the one m places behind the first beyond the wall
      const double s = -(m + 0.5);                   // cells from the wall, inwards
      const double wall = 4 * (s - 0.5) * (s - 1.5) / 3, near = -2 * s * (s - 1.5), far = 2 * s * (s - 0.5) / 3;
      const Expr twice_value = access(field, moved(m)) + access(field, moved(m + 1));
      const Expr parabola = (3 * wall / 2 * twice_value + 3 * near * along(field, moved(m + 1), axis - 1) +
                             3 * far * along(field, moved(m + 2), axis - 1)) /
                            3.0;
      const Expr beyond = select(is_inside(m + 2), parabola, image);
      result = m == std::abs(away) - 1 ? beyond : select(is_inside(m + 1), beyond, result);
    }
    return select(is_inside(0), image, result);
  }

  const Lowering& lowering_;
};

}  // namespace

Stage with_parabolas_at_walls(const Lowering& lowering, Stage stage) {
  const Parabolas parabolas(lowering);
  stage.kernel = map_kernel(stage.kernel, parabolas);
  for (Preparation& preparation : stage.before) {
    Kernel* kernel = std::get_if<Kernel>(&preparation);
    if (kernel && kernel->name.empty())
      *kernel = map_kernel(*kernel, parabolas);  // operands of reductions, in the interior as well
  }
  return stage;
}

}  // namespace dpde::stencil
