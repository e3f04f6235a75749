// SPDX-License-Identifier: Apache-2.0
// The layer for rotations and reflections: reorient(v, x = -y, y = x, channels = (-2, 1)).
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "model/from_ast/names/names.h"
#include "model/from_ast/network_from_ast.h"

namespace dpde::model {

namespace {

using network::Layer;

class OrientationReader {
 public:
  OrientationReader(int rank, const NumberOf& number_of, DiagnosticSink& sink)
      : rank_(rank), number_of_(number_of), sink_(sink) {}

  bool read_axes(const LayerOptions& options, SourceRange range, Layer& layer) {
    std::array<bool, 3> taken{};
    for (int axis = 0; axis < 3; ++axis) {
      const auto found = options.find(axis_name(axis));
      if (found == options.end() && axis >= rank_) continue;
      const int from = found == options.end() ? axis + 1 : signed_axis(found->second.value);
      if (from == 0) return false;
      if (axis >= rank_ || std::abs(from) > rank_)
        return refuse(range, fmt::format("the network is on a grid of {} {}", rank_, rank_ == 1 ? "axis" : "axes"));
      bool& is_taken = taken[static_cast<std::size_t>(std::abs(from)) - 1];
      if (is_taken)
        return refuse(range, fmt::format("two axes lie along {}", axis_name(std::abs(from) - 1)),
                      "each axis stands once: x = -y, y = x");
      is_taken = true;
      layer.axes[static_cast<std::size_t>(axis)] = from;
    }
    return true;
  }

  bool read_order(const ast::Expr& e, Layer& layer) {
    const auto* tuple = std::get_if<ast::Tuple>(&e->kind);
    const std::vector<ast::Expr> parts = tuple ? tuple->elements : std::vector<ast::Expr>{e};
    std::vector<bool> taken(static_cast<std::size_t>(layer.channels));
    for (const ast::Expr& part : parts) {
      const auto from = number_of_(part, "a channel");
      if (!from) return false;
      const double channel = std::abs(*from);
      const bool exists = channel >= 1 && channel <= layer.channels && channel == std::floor(channel);
      if (!exists || taken[static_cast<std::size_t>(channel) - 1]) {
        const std::string what = fmt::format("each of the {} stands once, with - where its sign changes",
                                             counted(layer.channels, "channel"));
        return refuse(part.range(), what, "as in channels = (-2, 1)");
      }
      taken[static_cast<std::size_t>(channel) - 1] = true;
      layer.order.push_back(static_cast<int>(*from));
    }
    if (static_cast<int>(parts.size()) == layer.channels) return true;
    return refuse(e.range(), fmt::format("these are {} of {}", parts.size(), counted(layer.channels, "channel")));
  }

 private:
  bool refuse(SourceRange range, const std::string& text, const std::string& hint = "") {
    sink_.report("bad-network", range, {text}, hint);
    return false;
  }

  /// Axis number from 1, negative for the opposite direction; 0 after a diagnostic.
  int signed_axis(const ast::Expr& e) {
    const auto* negative = std::get_if<ast::Unary>(&e->kind);
    const bool is_back = negative && negative->op == ast::UnaryOp::negate;
    const ast::Expr& inner = is_back ? negative->operand : e;
    const auto* name = std::get_if<ast::Name>(&inner->kind);
    const int axis = name ? axis_of(name->name) : -1;
    if (axis < 0)
      refuse(e.range(), "this is no axis", "write x = -x for the other direction, x = y, y = x for exchanged axes");
    return is_back ? -(axis + 1) : axis + 1;
  }

  const int rank_;
  const NumberOf& number_of_;
  DiagnosticSink& sink_;
};

}  // namespace

bool read_orientation(const LayerOptions& options, SourceRange range, int rank, const NumberOf& number_of,
                      network::Layer& layer, DiagnosticSink& sink) {
  OrientationReader reader(rank, number_of, sink);
  if (!reader.read_axes(options, range, layer)) return false;
  const auto order = options.find("channels");
  return order == options.end() || reader.read_order(order->second.value, layer);
}

}  // namespace dpde::model
