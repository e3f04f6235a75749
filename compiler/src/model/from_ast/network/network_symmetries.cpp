// SPDX-License-Identifier: Apache-2.0
// symmetric flips, rotations, galilean: symmetries of the grid under which a network is equivariant, and inputs taken
// relative to their mean.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/from_ast/network_from_ast.h"
#include "model/from_ast/parts.h"
#include "network/symmetrise.h"

namespace dpde::model {

namespace {

using network::Orientation;

constexpr Orientation as_it_is{1, 2, 3};

class SymmetryReader {
 public:
  SymmetryReader(Elaboration& elaboration, DeclaredNetwork& declared)
      : elaboration_(elaboration), declared_(declared), axes_(elaboration.problem.axes) {}

  /// Generators of the symmetry group; marks the inputs of galilean.
  std::vector<Orientation> run() {
    bool seen = false;
    for (const ast::Item& item : declared_.source->items) {
      const auto* symmetries = get_if<ast::SymmetryItem>(&item.kind);
      if (!symmetries) continue;
      if (seen) elaboration_.sink.report("repeated", item.range, {"the line symmetric"});
      for (const ast::SymmetryItem::Part& part : symmetries->parts) read(part);
      check_turns(*symmetries);
      seen = true;
    }
    return std::move(generators_);
  }

 private:
  void read(const ast::SymmetryItem::Part& part) {
    const std::string& word = part.word.name;
    if (word == "flip" || word == "flips") return read_flips(part);
    if (word == "rotations") return read_rotations(part);
    if (word == "galilean") return read_galilean(part);
    refuse(part.word.range, fmt::format("{} is no symmetry", word),
           "choose of: flips, flip x, rotations, rotations about z, galilean, galilean(u)");
  }

  void read_flips(const ast::SymmetryItem::Part& part) {
    if ((part.word.name == "flip") != part.axis.has_value()) return;  // only the parser writes parts
    if (part.axis && !axis(*part.axis)) return;
    for (int a = 0; a < rank(); ++a) {
      if (part.axis && axis_of(part.axis->name) != a) continue;
      if (is_stretched(a, part.word.range)) return;
      Orientation flip = as_it_is;
      flip[static_cast<std::size_t>(a)] = -(a + 1);
      generators_.push_back(flip);
    }
  }

  /// Reports rotations on one axis, which has none.
  void check_turns(const ast::SymmetryItem& symmetries) {
    const auto turns = std::ranges::find(symmetries.parts, "rotations",
                                         [](const ast::SymmetryItem::Part& part) { return part.word.name; });
    if (rank() > 1 || turns == symmetries.parts.end() || turns->axis) return;
    misfit(turns->word.range,
           "rotations turn one axis into another, and this scene has one axis: they would do nothing",
           generators_.empty() ? "write flips for the mirror image, or leave rotations out"
                               : "leave rotations out: flips alone are all that one axis has");
  }

  /// Quarter turns, in the plane normal to the named axis or in every plane.
  void read_rotations(const ast::SymmetryItem::Part& part) {
    if (part.axis && rank() < 3) {
      return misfit(part.axis->range,
                    fmt::format("rotations about an axis need a scene with three axes; this one has {}", rank()),
                    "write rotations");
    }
    if (part.axis && !axis(*part.axis)) return;
    for (int first = 0; first < rank(); ++first) {
      for (int second = first + 1; second < rank(); ++second) {
        const int about = 3 - first - second;
        if (part.axis && axis_of(part.axis->name) != about) continue;
        if (!are_alike(first, second, part.word.range)) return;
        Orientation turn = as_it_is;
        turn[static_cast<std::size_t>(first)] = -(second + 1);
        turn[static_cast<std::size_t>(second)] = first + 1;
        generators_.push_back(turn);
      }
    }
  }

  void read_galilean(const ast::SymmetryItem::Part& part) {
    const std::vector<ast::Network::Input>& inputs = declared_.source->inputs;
    declared_.relative.assign(inputs.size(), false);
    for (const ast::Identifier& name : part.inputs) {
      const auto found =
          std::ranges::find(inputs, name.name, [](const ast::Network::Input& input) { return input.name.name; });
      if (found == inputs.end()) {
        std::vector<std::string> known;
        for (const ast::Network::Input& input : inputs) known.push_back(input.name.name);
        elaboration_.sink.report("unknown-name", name.range, {name.name}, did_you_mean(name.name, known));
        continue;
      }
      declared_.relative[static_cast<std::size_t>(found - inputs.begin())] = true;
    }
    for (std::size_t i = 0; part.inputs.empty() && i < inputs.size(); ++i) declared_.relative[i] = inputs[i].vector;
    if (std::ranges::find(declared_.relative, true) != declared_.relative.end() || !part.inputs.empty()) return;
    refuse(part.word.range,
           fmt::format("network {} has no input that is a vector, and does not name the velocity",
                       declared_.source->name.name),
           inputs.empty() ? "" : fmt::format("write galilean({})", inputs.front().name.name));
  }

  /// Whether the scene has the axis; reports otherwise.
  bool axis(const ast::Identifier& name) {
    const int number = axis_of(name.name);
    if (number >= 0 && number < rank()) return true;
    if (number < 0) {
      elaboration_.sink.report("unknown-axis", name.range, {name.name});
    } else {
      misfit(name.range, fmt::format("the scene has no axis {}", name.name), "leave the symmetry out along this axis");
    }
    return false;
  }

  bool is_stretched(int axis, SourceRange range) {
    const Axis& a = axes_[static_cast<std::size_t>(axis)];
    if (!a.stretch) return false;
    misfit(range, fmt::format("axis {} is stretched, and its mirror image is another grid", a.name),
           "leave the symmetry out along this axis");
    return true;
  }

  /// A rotation must map the grid onto itself.
  bool are_alike(int first, int second, SourceRange range) {
    const Axis &a = axes_[static_cast<std::size_t>(first)], &b = axes_[static_cast<std::size_t>(second)];
    if (is_stretched(first, range) || is_stretched(second, range)) return false;
    const auto differ = [&](const std::string& text, const std::string& hint) {
      misfit(range, fmt::format("a rotation exchanges {} and {}, which {}", a.name, b.name, text), hint);
      return false;
    };
    const char* instead =
        rank() == 3 ? "write rotations about the axis across two that are alike, or flips" : "write flips";
    if (a.cells != b.cells) return differ(fmt::format("have {} and {} cells", a.cells, b.cells), instead);
    if (std::abs(a.spacing() - b.spacing()) > 1e-12 * a.spacing())
      return differ(fmt::format("have cells of {} and {}", a.spacing(), b.spacing()), instead);
    if (a.topology != b.topology) return differ(fmt::format("are {} and {}", word_of(a), word_of(b)), instead);
    const std::vector<network::Padding>& padding = declared_.network->padding;
    const auto of = [&](int axis) { return network::name_of(padding[static_cast<std::size_t>(axis)]); };
    if (of(first) != of(second))
      return differ(fmt::format("have the paddings {} and {}", of(first), of(second)), "give both the same padding");
    return true;
  }

  static const char* word_of(const Axis& axis) { return axis.topology == Topology::periodic ? "periodic" : "bounded"; }
  void refuse(SourceRange range, const std::string& text, const std::string& hint) {
    elaboration_.sink.report("bad-network", range, {text}, hint);
  }
  /// Applies to this grid only: other scenes of the file may call the network.
  void misfit(SourceRange range, const std::string& text, const std::string& hint) {
    declared_.misfits.push_back({range, text, hint});
  }
  int rank() const { return static_cast<int>(axes_.size()); }

  Elaboration& elaboration_;
  DeclaredNetwork& declared_;
  const std::vector<Axis>& axes_;
  std::vector<Orientation> generators_;
};

SourceRange symmetries_range(const ast::Network& source) {
  for (const ast::Item& item : source.items) {
    if (holds<ast::SymmetryItem>(item.kind)) return item.range;
  }
  return source.name.range;
}

}  // namespace

void bind_symmetries(Elaboration& elaboration, DeclaredNetwork& declared) {
  if (!declared.network) return;
  const std::size_t before = elaboration.sink.all().size();
  network::Symmetry symmetry{SymmetryReader(elaboration, declared).run(), {}, {}};
  for (const ast::Network::Input& input : declared.source->inputs) symmetry.inputs.push_back(input.vector);
  symmetry.outputs.assign(std::max<std::size_t>(declared.outputs.size(), 1), declared.vector);
  if (elaboration.sink.all().size() != before || !declared.misfits.empty()) {
    declared.network.reset();
    return;
  }
  declared.network = network::symmetrised(*declared.network, symmetry);
  const std::size_t layers = declared.network->layers.size(), images = network::group_of(symmetry.generators).size();
  if (layers <= static_cast<std::size_t>(most_layers)) return;
  elaboration.sink.report("bad-network", symmetries_range(*declared.source),
                          {fmt::format("for the {} images of the grid the network has {} layers, more than {}", images,
                                       layers, most_layers)},
                          "take fewer layers or a smaller symmetry");
  declared.network.reset();
}

}  // namespace dpde::model
