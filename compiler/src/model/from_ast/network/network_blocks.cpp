// SPDX-License-Identifier: Apache-2.0
// Items of a network block other than layers: padding, initialisation of weights, precision.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/from_ast/names/names.h"
#include "model/from_ast/names/seed.h"
#include "model/from_ast/network_from_ast.h"

namespace dpde::model {

namespace {

using network::Padding;

/// Calls `f` on the single item of a kind; reports further ones.
template <class Kind, class F>
void for_only(const ast::Network& source, const char* what, DiagnosticSink& sink, const F& f) {
  bool seen = false;
  for (const ast::Item& item : source.items) {
    const Kind* found = get_if<Kind>(&item.kind);
    if (!found) continue;
    if (seen) {
      sink.report("repeated", item.range, {what});
    } else {
      f(*found, item.range);
    }
    seen = true;
  }
}

std::optional<Padding> padding_called(const ast::Identifier& name, DiagnosticSink& sink) {
  for (const Padding padding : {Padding::periodic, Padding::zero, Padding::replicate, Padding::reflect}) {
    if (network::name_of(padding) == name.name) return padding;
  }
  sink.report("bad-network", name.range, {fmt::format("{} is no padding", name.name)},
              "choose one of: zero, replicate, reflect");
  return std::nullopt;
}

class PaddingReader {
 public:
  PaddingReader(const std::vector<Topology>& axes, DiagnosticSink& sink) : axes_(axes), sink_(sink) {
    for (const Topology topology : axes)
      result_.push_back(topology == Topology::periodic ? Padding::periodic : Padding::replicate);
  }

  void read(const ast::PaddingItem& item) {
    for (const ast::PaddingItem::Axis& stated : item.axes) {
      const auto padding = padding_called(stated.padding, sink_);
      if (!padding) return;
      if (!stated.name.name.empty()) {
        read_axis(stated, *padding);
      } else if (item.axes.size() > 1) {
        sink_.report("bad-network", stated.padding.range, {"of several paddings each is that of an axis"},
                     "write padding x zero, y replicate");
        return;
      } else {
        read_all(*padding, stated.padding.range);
      }
    }
  }

  std::vector<Padding> take() { return std::move(result_); }

 private:
  /// Padding of all bounded axes.
  void read_all(Padding padding, SourceRange range) {
    for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
      if (axes_[axis] == Topology::bounded) set(axis, padding, range);
    }
  }

  void read_axis(const ast::PaddingItem::Axis& stated, Padding padding) {
    const int axis = axis_of(stated.name.name);
    if (axis < 0) {
      sink_.report("unknown-axis", stated.name.range, {stated.name.name});
    } else if (axis >= static_cast<int>(axes_.size())) {
      sink_.report("missing-axis", stated.name.range, {stated.name.name});
    } else {
      set(static_cast<std::size_t>(axis), padding, stated.padding.range);
    }
  }

  void set(std::size_t axis, Padding padding, SourceRange range) {
    const bool is_periodic = axes_[axis] == Topology::periodic;
    result_[axis] = padding;
    if (is_periodic == (padding == Padding::periodic)) return;
    const std::string name = axis_name(static_cast<int>(axis));
    sink_.report(
        "bad-network", range,
        {fmt::format("axis {} is {}, and its padding cannot be {}", name, is_periodic ? "periodic" : "bounded",
                     network::name_of(padding))},
        is_periodic ? "one word without an axis holds for bounded axes only" : "write zero, replicate or reflect");
  }

  const std::vector<Topology>& axes_;
  DiagnosticSink& sink_;
  std::vector<Padding> result_;
};

/// The axes in padding x periodic, y zero.
std::optional<std::vector<Topology>> stated_axes(const ast::Network& source, DiagnosticSink& sink) {
  std::vector<Topology> axes;
  bool fine = true;
  for (const ast::Item& item : source.items) {
    const auto* padding = get_if<ast::PaddingItem>(&item.kind);
    for (const ast::PaddingItem::Axis& axis : padding ? padding->axes : std::vector<ast::PaddingItem::Axis>{}) {
      fine = fine && axes.size() < 3 && axis.name.name == axis_name(static_cast<int>(axes.size()));
      axes.push_back(axis.padding.name == "periodic" ? Topology::periodic : Topology::bounded);
    }
  }
  if (fine && !axes.empty()) return axes;
  sink.report("bad-network", source.name.range,
              {fmt::format("network {} does not say its padding along x, then y, then z", source.name.name)},
              "write padding x periodic, y zero");
  return std::nullopt;
}

}  // namespace

std::vector<Padding> paddings_of(const ast::Network& source, const std::vector<Topology>& axes, DiagnosticSink& sink) {
  PaddingReader reader(axes, sink);
  for_only<ast::PaddingItem>(source, "the padding", sink,
                             [&](const ast::PaddingItem& item, SourceRange) { reader.read(item); });
  return reader.take();
}

NetworkStart start_of(const ast::Network& source, const NumberOf& number_of, DiagnosticSink& sink) {
  NetworkStart start;
  for_only<ast::StartItem>(source, "the begin of the weights", sink, [&](const ast::StartItem& item, SourceRange) {
    const auto init = item.method ? find_init(item.method->name) : std::optional(start.init);
    if (!init) sink.report("bad-network", item.method->range, {"weights begin as he, xavier or zero"});
    start.init = init.value_or(start.init);
    const auto seed = item.seed ? number_of(*item.seed, "the seed") : std::nullopt;
    if (seed && !is_seed(*seed)) sink.report("bad-seed", item.seed->range(), {fmt::format("{}", *seed)});
    if (seed && is_seed(*seed)) start.seed = static_cast<std::uint64_t>(*seed);
  });
  for_only<ast::RealItem>(source, "the precision", sink, [&](const ast::RealItem& item, SourceRange) {
    const bool is_f64 = item.precision.name == "f64";
    start.real = is_f64 ? Precision::f64 : Precision::f32;
    if (is_f64 || item.precision.name == "f32") return;
    sink.report("bad-network", item.precision.range, {fmt::format("{} is no precision", item.precision.name)},
                "choose one of: f32, f64");
  });
  return start;
}

namespace {

/// host weights 120, which must be the only item; false after a diagnostic.
bool read_host(const ast::Network& source, const NumberOf& number_of, network::Network& network, DiagnosticSink& sink) {
  for_only<ast::HostItem>(source, "host", sink, [&](const ast::HostItem& item, SourceRange) {
    constexpr double most = 1e9;  // limited by memory
    const auto count = number_of(item.weights, "the number of weights");
    if (!count) return;
    if (*count >= 0 && *count <= most && *count == std::floor(*count)) {
      network.host_weights = static_cast<std::int64_t>(*count);
    } else {
      sink.report("bad-network", item.weights.range(),
                  {fmt::format("the number of weights is a whole number from 0 to {:.0f}, not {}", most, *count)});
    }
  });
  if (!network.is_host()) return false;
  network.real = Precision::f64;  // precision of the host's function
  for (const ast::Item& item : source.items) {
    if (holds<ast::HostItem>(item.kind) || holds<ast::PaddingItem>(item.kind)) continue;
    sink.report("bad-network", item.range,
                {fmt::format("network {} is the host's own: it has neither layers nor a start of its weights",
                             source.name.name)},
                "take this line out, or the line with host");
    return false;
  }
  return true;
}

bool has_host(const ast::Network& source) {
  return std::ranges::any_of(source.items, [](const ast::Item& item) { return holds<ast::HostItem>(item.kind); });
}

}  // namespace

std::optional<network::Network> network_from_ast(const ast::Network& source, const NetworkFrame& frame,
                                                 const NumberOf& number_of, DiagnosticSink& sink) {
  const std::size_t before = sink.all().size();
  network::Network result;
  result.name = source.name.name;
  result.inputs = frame.inputs;
  result.outputs = frame.outputs;
  result.padding = paddings_of(source, frame.axes, sink);
  const NetworkStart start = start_of(source, number_of, sink);
  result.seed = start.seed;
  result.real = start.real.value_or(frame.real);
  const bool fine = has_host(source) ? read_host(source, number_of, result, sink)
                                     : add_layers(source, start.init, number_of, result, sink);
  return fine && sink.all().size() == before ? std::optional(result) : std::nullopt;
}

bool counts_channels(const ast::Network& source) { return source.input_channels && source.output_channels; }

std::optional<network::Network> network_from_ast(const ast::Network& source, DiagnosticSink& sink) {
  if (!counts_channels(source) || *source.input_channels < 1 || *source.output_channels < 1) {
    sink.report("bad-network", source.name.range,
                {fmt::format("network {} does not say how many channels it has", source.name.name)},
                fmt::format("below the model inputs and outputs are numbers: network {}(3) -> 2", source.name.name));
    return std::nullopt;
  }
  const auto axes = stated_axes(source, sink);
  if (!axes) return std::nullopt;
  for (const ast::Item& item : source.items) {
    if (!holds<ast::SymmetryItem>(item.kind)) continue;
    sink.report("bad-network", item.range,
                {"symmetric stands in networks whose inputs have names: what is a vector is not known here"},
                "write out the copies: reorient(v, x = -x, channels = (-1, 2)), conv(..., weights = v1)");
    return std::nullopt;
  }
  const auto literal = [&](const ast::Expr& e, const std::string& what) -> std::optional<double> {
    const auto* negative = std::get_if<ast::Unary>(&e->kind);
    const bool is_negative = negative && negative->op == ast::UnaryOp::negate;
    const ast::Expr& inner = is_negative ? negative->operand : e;
    const auto* number = std::get_if<ast::Number>(&inner->kind);
    if (number) return is_negative ? -number->value : number->value;
    sink.report("bad-network", e.range(), {fmt::format("{} is a number here", what)});
    return std::nullopt;
  };
  return network_from_ast(source, {*source.input_channels, *source.output_channels, *axes}, literal, sink);
}

}  // namespace dpde::model
