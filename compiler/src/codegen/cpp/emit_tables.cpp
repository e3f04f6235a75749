// SPDX-License-Identifier: Apache-2.0
// The structs of kernel_abi.h and scene_abi.h as C++ constants; no code runs at start-up. Operations are unpacked by
// structured bindings, so adding a field to a struct causes a compile error here.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <map>

#include "codegen/cpp/emit_cpp.h"
#include "codegen/cpp/emit_library.h"

namespace dpde::codegen {

namespace {

template <class Item, class Text>
std::vector<std::string> texts(const Item* items, int32_t count, const Text& text) {
  std::vector<std::string> result;
  for (int32_t i = 0; i < count; ++i) result.push_back(text(items[i]));
  return result;
}

std::string quoted(const char* text) { return text ? fmt::format("\"{}\"", text) : "nullptr"; }

std::string three(const int64_t (&values)[3]) { return fmt::format("{{{}, {}, {}}}", values[0], values[1], values[2]); }

/// Writes tables. The name of each is its kind and a number.
class Tables {
 public:
  /// Defines an array and returns its name; "nullptr" for an empty one.
  std::string array(const std::string& type, const std::string& what, const std::vector<std::string>& items) {
    if (items.empty()) return "nullptr";
    const std::string name = fmt::format("dpde_{}_{}", what, count_[what]++);
    out_ += fmt::format("static const {} {}[] = {{{}}};\n", type, name, fmt::join(items, ", "));
    return name;
  }
  std::string names(const char* const* items, int32_t count) {
    const std::string key = fmt::format("{}", fmt::join(texts(items, count, quoted), ", "));
    const auto found = names_.find(key);
    if (found != names_.end()) return found->second;
    return names_[key] = array("char* const", "names", texts(items, count, quoted));
  }
  /// "nullptr" or the address of the program's struct, defined at its first use.
  std::string program(const dpde_program* source);
  std::string network(const dpde_network* source);
  std::string instants(const dpde_instants& at) {
    if (at.count < 0) return "{-1, nullptr}";
    return fmt::format(
        "{{{}, {}}}", at.count,
        array("int32_t", "steps", texts(at.steps, at.count, [](int32_t k) { return fmt::format("{}", k); })));
  }
  const std::string& text() const { return out_; }

 private:
  std::string rule(const dpde_rule* source);
  std::string fill(const dpde_fill& source);
  std::string kernel(const dpde_kernel& source);
  std::string operation(const dpde_operation& source, const dpde_program& program);
  std::string inference(const dpde_inference& source, const dpde_program& program);
  std::string transform(const dpde_transform& source);
  std::string repeat(const dpde_repeat& source, const dpde_program& program);
  std::string solve(const dpde_solve& source, const dpde_program& program);
  std::string operations(const dpde_operation* items, int32_t count, const dpde_program& program) {
    return array("dpde_operation", "operations",
                 texts(items, count, [&](const dpde_operation& o) { return operation(o, program); }));
  }
  std::string indices(const int32_t* items, int32_t count) {
    return array("int32_t", "indices", texts(items, count, [](int32_t index) { return fmt::format("{}", index); }));
  }

  std::string out_;
  std::map<std::string, int> count_;
  std::map<std::string, std::string> names_;
  std::map<const dpde_program*, std::string> programs_;
  std::map<std::string, std::string> networks_;
  std::map<const dpde_rule*, std::string> rules_;
};

std::string number(double value) {
  if (std::isfinite(value)) return fmt::format("{}", value);
  return value < 0 ? "-__builtin_inf()" : "__builtin_inf()";
}

std::string text_of(const dpde_ghost_number& n) {
  return fmt::format("{{{}, {}}}", number(n.fixed), number(n.per_distance));
}

std::string text_of(const dpde_ghost_row& row) {
  const auto term = [](const dpde_ghost_term& t) {
    return fmt::format("{{{}, {}, {}}}", text_of(t.ghost), text_of(t.mirror), text_of(t.second));
  };
  return fmt::format("{{{{{}}}, {}, {}, {}}}", fmt::join(texts(row.terms, DPDE_SIDE_COEFFICIENTS, term), ", "),
                     text_of(row.rate), row.first, row.step);
}

std::string text_of(const dpde_ghost_rows& rows) {
  return fmt::format("{{{}, {}, {}}}", text_of(rows.row), rows.least, text_of(rows.of_few));
}

/// "nullptr" or the address of the rule, defined at its first use.
std::string Tables::rule(const dpde_rule* source) {
  if (source == nullptr) return "nullptr";
  const auto found = rules_.find(source);
  if (found != rules_.end()) return found->second;
  const std::string name = fmt::format("dpde_rule_{}", rules_.size());
  out_ += fmt::format("static const dpde_rule {} = {{{}, {},\n    {},\n    {}}};\n", name, source->on_walls,
                      source->turns, text_of(source->wall), text_of(source->beyond));
  return rules_[source] = "&" + name;
}

std::string Tables::fill(const dpde_fill& f) {
  const auto side = [&](const dpde_side& s) {
    return fmt::format("{{{}, {{{}}}, {}, {}}}", rule(s.rule), fmt::join(s.coefficients, ", "), s.value, s.field);
  };
  const auto axis = [&](const dpde_boundary& b) {
    const std::string low = side(b.low), high = side(b.high);
    return fmt::format("{{{}, {}}}", low, high);
  };
  return fmt::format("{{{}, {{{}}}}}", f.field, fmt::join(texts(f.axes, DPDE_MAX_RANK, axis), ", "));
}

std::string Tables::kernel(const dpde_kernel& k) {
  const auto stream = [](const dpde_stream& s) {
    return fmt::format("{{{}, {{{}, {}, {}}}, {}}}", s.field, s.offset[0], s.offset[1], s.offset[2], s.is_written);
  };
  const auto grid = [](const dpde_grid& g) { return fmt::format("{{{}, {}}}", g.field, g.is_written); };
  const auto number = [](int32_t n) { return fmt::format("{}", n); };
  const std::string streams = array("dpde_stream", "streams", texts(k.streams, k.stream_count, stream));
  const std::string grids = array("dpde_grid", "grids", texts(k.grids, k.grid_count, grid));
  const std::string sums = array("int32_t", "sums", texts(k.sums, k.sum_count, number));
  return fmt::format("{{{}, {}, {}, {}, {}, {}, {}, {}, 0, nullptr, {}}}", quoted(k.name), symbol_of(k.name),
                     k.stream_count, streams, k.grid_count, grids, k.sum_count, sums, k.own);
}

/// "nullptr" or the address of the network's struct, defined at its first use.
std::string Tables::network(const dpde_network* source) {
  const auto found = networks_.find(source->name);
  if (found != networks_.end()) return found->second;
  const auto layer = [&](const dpde_layer& l) {
    const auto number = [](int32_t channel) { return fmt::format("{}", channel); };
    const std::string order = l.order ? array("int32_t", "orders", texts(l.order, l.channels, number)) : "nullptr";
    return fmt::format("{{{}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {{{}, {}, {}}}, {}}}", l.kind,
                       l.input, l.other, l.channels, l.extent, l.stride, l.dilation, l.groups, l.activation, l.factor,
                       l.weights, l.bias, l.init, l.gain, l.axes[0], l.axes[1], l.axes[2], order);
  };
  const dpde_network& n = *source;
  const std::string layers = array("dpde_layer", "layers", texts(n.layers, n.layer_count, layer));
  const std::string name = fmt::format("dpde_network_{}", networks_.size());
  out_ += fmt::format("static const dpde_network {} = {{{}, {}, {}, {}, {}, {{{}, {}, {}}}, {}, {}u, {}, {}, {}}};\n",
                      name, quoted(n.name), n.rank, n.real, n.inputs, n.outputs, n.padding[0], n.padding[1],
                      n.padding[2], n.weight_count, n.seed, n.layer_count, layers, n.is_host);
  return networks_[source->name] = "&" + name;
}

std::string Tables::inference(const dpde_inference& i, const dpde_program& program) {
  const auto& [network, mode, inputs, rates, results, weights] = i;
  const dpde_network& n = *program.networks[network];
  const bool is_adjoint = mode == DPDE_NETWORK_ADJOINT, is_second = mode == DPDE_NETWORK_SECOND;
  const std::string read = indices(inputs, n.inputs);
  const std::string rated = indices(rates, mode == DPDE_NETWORK_VALUE ? 0
                                           : is_second                ? n.inputs + n.outputs
                                           : is_adjoint               ? n.outputs
                                                                      : n.inputs);
  const std::string made = indices(results, is_second ? 2 * n.inputs : is_adjoint ? n.inputs : n.outputs);
  return fmt::format("{{{}, {}, {}, {}, {}, {}}}", network, mode, read, rated, made, weights);
}

std::string Tables::transform(const dpde_transform& t) {
  const auto& [term_count, terms, result, axes] = t;
  const auto monomial = [](const dpde_monomial& m) {
    const auto& [uniform, powers] = m;
    return fmt::format("{{{}, {{{}, {}, {}}}}}", uniform, powers[0], powers[1], powers[2]);
  };
  const auto symbol = [&](const dpde_symbol& s) {
    const auto& [count, monomials] = s;
    return fmt::format("{{{}, {}}}", count, array("dpde_monomial", "symbols", texts(monomials, count, monomial)));
  };
  const auto term = [&](const dpde_transform_term& by) {
    const auto& [field, function, number, argument, factor, within_two_thirds] = by;
    const std::string of_argument = symbol(argument), of_factor = symbol(factor);
    return fmt::format("{{{}, {}, {}, {}, {}, {}}}", field, function, number, of_argument, of_factor,
                       within_two_thirds);
  };
  const std::string all = array("dpde_transform_term", "terms", texts(terms, term_count, term));
  return fmt::format("{{{}, {}, {}, {{{}, {}, {}}}}}", term_count, all, result, axes[0], axes[1], axes[2]);
}

std::string Tables::operation(const dpde_operation& o, const dpde_program& program) {
  const auto& [kind, filled, kernel, grow, serial, then_count, then, reduced, inferred, repeated, transformed, solved] =
      o;
  const auto one_fill = [&](const dpde_fill& f) { return fill(f); };
  const std::string fills = array("dpde_fill", "fills", texts(then, then_count, one_fill));
  const auto& [reduction, field, result, over] = reduced;
  const std::string reduce =
      fmt::format("{{{}, {}, {}, {{{}, {}, {}}}}}", reduction, field, result, over[0], over[1], over[2]);
  return fmt::format("{{{}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}}}", kind, fill(filled), kernel, three(grow),
                     serial, then_count, fills, reduce, kind == DPDE_NETWORK ? inference(inferred, program) : "{}",
                     kind == DPDE_REPEAT ? repeat(repeated, program) : "{}",
                     kind == DPDE_TRANSFORM ? transform(transformed) : "{}",
                     kind == DPDE_SOLVE ? solve(solved, program) : "{}");
}

std::string Tables::solve(const dpde_solve& s, const dpde_program& program) {
  const auto& [count, images, rights, unknowns, operation_count, block, method, smoother, tolerance, most_iterations,
               warns, reach, coefficient_count, coefficients, param_count, params, is_linear, step, preconditioner,
               guess_count, guesses, network, is_symmetric, takes_constants_to_zero, sums_to_zero] = s;
  const std::string of_images = indices(images, count), of_rights = indices(rights, count),
                    of_unknowns = indices(unknowns, count), body = operations(block, operation_count, program),
                    read = indices(coefficients, coefficient_count), numbers = indices(params, param_count);
  const std::string newton_step =
      step == nullptr ? "nullptr" : array("dpde_solve", "newton_steps", {solve(*step, program)});
  const std::string begin = indices(guesses, guess_count);
  const std::string precondition =
      network == nullptr ? "nullptr" : array("dpde_inference", "preconditioners", {inference(*network, program)});
  return fmt::format(
      "{{{}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}}}", count,
      of_images, of_rights, of_unknowns, operation_count, body, method, smoother, number(tolerance), most_iterations,
      warns, three(reach), coefficient_count, read, param_count, numbers, is_linear, newton_step, preconditioner,
      guess_count, begin, precondition, is_symmetric, takes_constants_to_zero, sums_to_zero);
}

std::string Tables::repeat(const dpde_repeat& r, const dpde_program& program) {
  const auto& [count, operation_count, block, carry_count, carries, save_count, saves, load_count, loads, counter,
               first, step] = r;
  const auto carry = [](const dpde_carry& c) { return fmt::format("{{{}, {}, {}}}", c.state, c.next, c.result); };
  const auto stacked = [](const dpde_stacked& s) { return fmt::format("{{{}, {}}}", s.field, s.stack); };
  const std::string body = operations(block, operation_count, program);
  const std::string carried = array("dpde_carry", "carries", texts(carries, carry_count, carry));
  const std::string saved = array("dpde_stacked", "saves", texts(saves, save_count, stacked));
  const std::string loaded = array("dpde_stacked", "loads", texts(loads, load_count, stacked));
  return fmt::format("{{{}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}}}", count, operation_count, body, carry_count,
                     carried, save_count, saved, load_count, loaded, counter, first, step);
}

std::string Tables::program(const dpde_program* source) {
  if (source == nullptr) return "nullptr";
  const auto found = programs_.find(source);
  if (found != programs_.end()) return found->second;
  const dpde_program& p = *source;
  out_ += fmt::format("\n// program {}\n", p.name);
  const auto swap = [](const dpde_swap& s) { return fmt::format("{{{}, {}, {}}}", s.state, s.next, s.is_over); };
  const std::string fields = names(p.fields, p.field_count), params = names(p.params, p.param_count),
                    sums = names(p.sums, p.sum_count);
  const std::string kernels = array("dpde_kernel", "kernels",
                                    texts(p.kernels, p.kernel_count, [&](const dpde_kernel& k) { return kernel(k); }));
  const auto one_fill = [&](const dpde_fill& f) { return fill(f); };
  const std::string prepare = array("dpde_fill", "fills", texts(p.prepare, p.prepare_count, one_fill));
  const std::string body = operations(p.operations, p.operation_count, p);
  const std::string networks =
      array("dpde_network* const", "networks",
            texts(p.networks, p.network_count, [&](const dpde_network* n) { return network(n); }));
  const std::string stacks = array(
      "int64_t", "stacks", texts(p.stacks, p.stack_count, [](int64_t passes) { return fmt::format("{}", passes); }));
  const std::string swaps = array("dpde_swap", "swaps", texts(p.swaps, p.swap_count, swap));
  const auto link = [](const dpde_link& l) {
    return fmt::format("{{{}, {}, {}, {}}}", l.kind, quoted(l.primal), l.derived_kind, l.derived);
  };
  const std::string links = array("dpde_link", "links", texts(p.links, p.link_count, link));
  const std::string name = fmt::format("dpde_program_{}", programs_.size());
  out_ += fmt::format("static const dpde_program {} = {{\n", name);
  out_ += fmt::format("    DPDE_ABI_VERSION, {}, {}, {}, {},\n", quoted(p.name), p.rank,
                      p.real == DPDE_F32 ? "DPDE_F32" : "DPDE_F64", three(p.halo));
  out_ += fmt::format("    {}, {}, {},  // fields, inputs first\n", p.field_count, p.input_count, fields);
  out_ +=
      fmt::format("    {}, {}, {}, {}, dpde_compute_uniforms, {},  // parameters, counters, uniforms\n", p.param_count,
                  params, p.counter_count, p.uniform_count, p.counter_count > 0 ? "dpde_compute_counted" : "nullptr");
  out_ += fmt::format("    {}, {}, {}, {},  // sums, kernels\n", p.sum_count, sums, p.kernel_count, kernels);
  out_ += fmt::format("    {}, {}, {}, {}, {}, {}, {}, {},  // prepare, operations, stacks, swaps\n", p.prepare_count,
                      prepare, p.operation_count, body, p.stack_count, stacks, p.swap_count, swaps);
  out_ += fmt::format("    {}, {}, {}, {},  // networks, links\n", p.network_count, networks, p.link_count, links);
  out_ += "    nullptr, nullptr};\n";
  return programs_[source] = "&" + name;
}

std::string second(const dpde_second& s, Tables& tables) {
  const std::string tangent = tables.program(s.tangent), adjoint = tables.program(s.adjoint);
  return fmt::format("{{{}, {}}}", tangent, adjoint);
}

std::string axis(const dpde_axis& a, Tables& tables) {
  const int count = a.centres == nullptr ? 0 : static_cast<int>(a.cells);
  const std::string centres = tables.array("double", "centres", texts(a.centres, count, number));
  return fmt::format("{{{}, {}, {}, {}, {}, {}}}", quoted(a.name), a.low, a.high, a.cells, a.is_periodic, centres);
}

/// The scene's programs, and the fields of the last program (output_program) that are outputs.
std::string programs_of(const dpde_scene& s, Tables& tables) {
  const auto output = [](const dpde_output& o) { return fmt::format("{{{}, {}}}", quoted(o.name), quoted(o.field)); };
  const auto variant = [&](const dpde_adjoint_variant& v) {
    return fmt::format("{{{}, {}}}", tables.program(v.adjoint), tables.program(v.step));
  };
  const std::string variants = tables.array("dpde_adjoint_variant", "adjoint_variants",
                                            texts(s.adjoint_variants, s.adjoint_variant_count, variant));
  std::string programs = fmt::format("{}, {}, {}, {}, ", tables.program(s.program), tables.program(s.adjoint),
                                     s.adjoint_variant_count, variants);
  for (const dpde_program* p : {s.initial, s.initial_adjoint, s.coefficient_formulas, s.coefficient_adjoint, s.start,
                                s.observe, s.output_program}) {
    programs += tables.program(p) + ", ";
  }
  const std::string outputs = tables.array("dpde_output", "outputs", texts(s.outputs, s.output_count, output));
  return fmt::format("{}{}, {},", programs, s.output_count, outputs);
}

/// Weights of each network, where the scene has them.
std::vector<std::string> weights_of(const dpde_scene& s, Tables& tables) {
  std::vector<std::string> weights;
  for (int32_t n = 0; n < s.network_count; ++n) {
    const auto count = static_cast<int32_t>(s.networks[n]->weight_count);
    weights.push_back(s.weights[n] ? tables.array("double", "weights", texts(s.weights[n], count, number)) : "nullptr");
  }
  return weights;
}

std::string value_text(const dpde_value& v) {
  return fmt::format("{{{}, {}, {}}}", quoted(v.name), v.value, v.is_fixed);
}

/// Formulas that were substituted into others, units, and the values that gradients are checked for.
std::string facts_of(const dpde_scene& s, Tables& tables) {
  const auto put_in = [](const dpde_put_in& p) { return fmt::format("{{{}, {}}}", quoted(p.name), quoted(p.in)); };
  const auto unit = [](const dpde_unit& u) { return fmt::format("{{{}, {}}}", quoted(u.name), quoted(u.unit)); };
  const auto watched = [](const dpde_watched& w) {
    return fmt::format("{{{}, {}, {}, {}, {}, {}, {}, {}}}", quoted(w.field), quoted(w.below), quoted(w.above),
                       quoted(w.text), quoted(w.help), w.is_switch, w.begins_with_one_sign, w.loss);
  };
  return fmt::format("{}, {}, {}, {}, {}, {}, {}, {}", s.put_in_count,
                     tables.array("dpde_put_in", "put_in", texts(s.put_in, s.put_in_count, put_in)), s.unit_count,
                     tables.array("dpde_unit", "units", texts(s.units, s.unit_count, unit)), tables.program(s.watched),
                     tables.program(s.watched_step), s.watched_count,
                     tables.array("dpde_watched", "watched", texts(s.watched_values, s.watched_count, watched)));
}

/// The scene's initialiser. The tables it points to are added to `tables`.
std::string scene_text(const dpde_scene& s, Tables& tables) {
  const auto source = [](const dpde_source& v) { return fmt::format("{{{}, {}}}", quoted(v.name), v.has_formula); };
  const auto datum = [&](const dpde_datum& d) {
    return fmt::format("{{{}, {}, {}}}", quoted(d.name), tables.instants(d.at), d.is_number);
  };
  const auto unknown = [](const dpde_unknown& u) {
    return fmt::format("{{{}, {}, {}, {}, {}}}", quoted(u.name), u.kind, u.start, number(u.low), number(u.high));
  };
  const auto loss = [&](const dpde_loss& l) {
    const std::string program = tables.program(l.loss), adjoint = tables.program(l.adjoint);
    const std::string full = second(l.full, tables), squares = second(l.gauss_newton, tables);
    return fmt::format("{{{}, {}, {}, {}, {}, {}, {}, {}}}", program, adjoint, tables.instants(l.at), full, squares,
                       quoted(l.average), l.of_averages, number(l.weight));
  };
  const std::string programs = programs_of(s, tables);
  const std::string params = tables.array("dpde_value", "params", texts(s.params, s.param_count, value_text));
  const auto control = [&](const dpde_control& c) {
    return fmt::format("{{{}, {}, {}, {}}}", quoted(c.name), c.every, c.count,
                       tables.array("double", "values", texts(c.values, c.count, number)));
  };
  const std::string controls = tables.array("dpde_control", "controls", texts(s.controls, s.control_count, control));
  const std::string states = tables.array("dpde_source", "states", texts(s.states, s.state_count, source));
  const auto coefficient = [&](const dpde_coefficient& c) {
    return fmt::format("{{{}, {}, {}, {}, {}}}", quoted(c.name), c.has_formula, c.every, c.count,
                       tables.program(c.formula));
  };
  const auto noise = [](const dpde_noise& n) { return fmt::format("{{{}, {}u}}", quoted(n.name), n.seed); };
  const std::string coefficients =
      tables.array("dpde_coefficient", "coefficients", texts(s.coefficients, s.coefficient_count, coefficient));
  const std::string noises = tables.array("dpde_noise", "noises", texts(s.noises, s.noise_count, noise));
  const std::string networks =
      tables.array("dpde_network* const", "networks",
                   texts(s.networks, s.network_count, [&](const dpde_network* n) { return tables.network(n); }));
  const std::string weight_lists = tables.array("double* const", "weight_lists", weights_of(s, tables));
  const std::string sought = tables.names(s.sought, s.sought_count);
  const std::string data = tables.array("dpde_datum", "data", texts(s.data, s.datum_count, datum));
  const std::string losses = tables.array("dpde_loss", "losses", texts(s.losses, s.loss_count, loss));
  const std::string unknowns = tables.array("dpde_unknown", "unknowns", texts(s.unknowns, s.unknown_count, unknown));
  std::string seconds;
  for (const dpde_second& of : {s.second, s.initial_second, s.coefficient_second}) seconds += ", " + second(of, tables);
  const std::vector<std::string> axes = texts(s.axes, s.rank, [&](const dpde_axis& a) { return axis(a, tables); });
  std::string out = fmt::format("    DPDE_SCENE_VERSION, {}, {}, {},\n", quoted(s.name), quoted(s.task), s.rank);
  out += fmt::format("    {{{}}},  // axes\n", fmt::join(axes, ", "));
  out += fmt::format("    {}, {}, {}, {},  // begin, step, steps, steady\n", s.t_begin, s.step, s.steps, s.steady);
  out += fmt::format("    {}, {}, {}, {}, {}, {}, {},  // parameters, controls, Courant number\n", s.param_count,
                     params, s.control_count, controls, tables.program(s.rate), s.courant, quoted(s.rate_field));
  out += fmt::format("    {}, {{{}, {}}},  // tolerance\n", tables.program(s.trial), s.control.order, s.control.first);
  out += fmt::format(
      "    {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {},  // states, coefficients, noise, networks, sought "
      "coefficients\n",
      s.state_count, states, s.coefficient_count, coefficients, s.noise_count, noises, s.network_count, networks,
      weight_lists, s.sought_count, sought);
  out += fmt::format("    {}\n", programs);
  out += fmt::format("    {}, {}, {}, {}, {}, {},\n", s.datum_count, data, s.loss_count, losses, s.unknown_count,
                     unknowns);
  out += fmt::format("    {{{}, {}, {}, {}}},  // optimiser\n", s.optimiser.method, s.optimiser.rate,
                     s.optimiser.gauss_newton, s.optimiser.iterations);
  out += fmt::format("    {}{},\n    {}", quoted(s.no_second), seconds, facts_of(s, tables));
  return out;
}

}  // namespace

std::string emit_library_source(const loop::Module& module, const dpde_scene& scene, const std::string& name,
                                const SourceFile& source) {
  std::string out = emit_cpp(module, &source, RowLinkage::within_the_file);
  out.insert(out.find("#include \"dpde/kernel_abi.h\""), "#include \"dpde/scene_abi.h\"\n");
  Tables tables;
  const std::string initialiser = scene_text(scene, tables);
  out += "\n// What the runtime has to know of the rows.\n" + tables.text();
  out += fmt::format("\nextern \"C\" __attribute__((visibility(\"default\"))) const dpde_scene {}_scene = {{\n{}}};\n",
                     name, initialiser);
  return out;
}

}  // namespace dpde::codegen
