// SPDX-License-Identifier: Apache-2.0
// The layers of a network: each word or call becomes one, with the channels and the grid of its result.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "model/from_ast/names/names.h"
#include "model/from_ast/network/layer_words.h"
#include "model/from_ast/network_from_ast.h"
#include "support/match.h"

namespace dpde::model {

namespace {

using network::Activation;
using network::Layer;
using network::LayerKind;

constexpr int most_channels = 65536, most_extent = 63, most_stride = 64, most_dilation = 1024;

std::string grid_phrase(int size) {
  return size == 1 ? "the grid of the fields" : fmt::format("a grid {} times coarser", size);
}

class LayerReader {
 public:
  LayerReader(const ast::Network& source, network::Init init, const NumberOf& number_of, network::Network& network,
              DiagnosticSink& sink)
      : source_(source), init_(init), number_of_(number_of), network_(network), sink_(sink) {}

  bool run() {
    const auto is_let = [](const ast::Item& item) { return is_value_form(item); };
    as_values_ = std::ranges::any_of(source_.items, is_let);
    read_items(source_.items, false);
    if (as_values_) check_values();
    if (!failed_) check_output();
    return !failed_;
  }

 private:
  static bool is_value_form(const ast::Item& item) {
    return holds<ast::LetItem>(item.kind) || holds<ast::AssignItem>(item.kind);
  }

  // ---- messages ----------------------------------------------------------------------------------------------------
  /// Only the first error is reported; others would follow from it.
  void fail(KindRef kind, SourceRange range, std::initializer_list<std::string> arguments,
            const std::string& hint = "") {
    if (!failed_) sink_.report(kind, range, arguments, hint);
    failed_ = true;
  }
  void refuse(SourceRange range, const std::string& text, const std::string& hint = "") {
    fail("bad-network", range, {text}, hint);
  }

  // ---- known properties of values ----------------------------------------------------------------------------------
  int channels(int value) const { return network::channels_of(network_, value); }
  int size(int value) const { return value == 0 ? 1 : sizes_[static_cast<std::size_t>(value) - 1]; }

  // ---- items -------------------------------------------------------------------------------------------------------
  void read_items(const std::vector<ast::Item>& items, bool inside) {
    for (const ast::Item& item : items) {
      if (failed_) return;
      last_range_ = item.range;
      match(
          item.kind, [&](const ast::LayerItem& i) { read_word(i, item.range); },
          [&](const ast::BranchItem& i) { read_branch(i); }, [&](const ast::RepeatItem& i) { read_repeat(i); },
          [&](const ast::LetItem& i) { read_let(i, item.range, inside); },
          [&](const ast::AssignItem& i) { read_output(i, inside); },
          [&](const auto&) {
            if (inside)
              fail("not-allowed-here", item.range, {"this line", "a block of layers"},
                   "write it above the layers of the network");
          });
    }
  }

  /// In a network with named values, layers cannot be bare words.
  bool refuses_words(SourceRange range) {
    if (as_values_)
      refuse(range, "layers are written as words or as values, not as both",
             "write let v = relu(in), or no let and no out =");
    return as_values_;
  }

  void read_word(const ast::LayerItem& item, SourceRange range) {
    if (refuses_words(range)) return;
    const LayerWord* word = find_word(item.layer);
    if (!word) return;
    if (joins(word->kind)) {
      const char* block = word->kind == LayerKind::add ? "residual" : "skip";
      return refuse(range, fmt::format("{} takes two values", word->name),
                    fmt::format("write {} {{ ... }}, or name the values: {}", block, word->example));
    }
    current_ = add(*word, item.layer.range, range, {current_}, item.arguments);
  }

  void read_branch(const ast::BranchItem& branch) {
    if (refuses_words(branch.word_range)) return;
    const bool adds = branch.join == ast::BranchItem::Join::add;
    const int input = current_;
    read_items(branch.items, true);
    if (failed_) return;
    if (current_ == input)
      return refuse(branch.word_range, fmt::format("the body of {} has no layers", adds ? "residual" : "skip"));
    current_ =
        join(adds ? LayerKind::add : LayerKind::concat, adds ? "residual" : "skip", branch.word_range, input, current_);
  }

  void read_repeat(const ast::RepeatItem& repeat) {
    if (refuses_words(repeat.count_range)) return;
    if (repeat.count < 1 || repeat.count > most_layers) {
      return fail("bad-repeat", repeat.count_range,
                  {"1 to " + std::to_string(most_layers), std::to_string(repeat.count)});
    }
    const std::size_t before = network_.layers.size();
    for (int pass = 0; pass < repeat.count && !failed_; ++pass) {
      const std::size_t begin = network_.layers.size();
      read_items(repeat.items, true);
      // each pass adds a layer, so the limit of layers also limits passes
      if (network_.layers.size() == before) refuse(repeat.count_range, "the body of repeat has no layers");
      if (repeat.shared && pass > 0) share(before, begin, repeat.count_range);
    }
  }

  /// Layers from `begin` on share the weights of the layers from `first` on.
  void share(std::size_t first, std::size_t begin, SourceRange range) {
    for (std::size_t i = 0; begin + i < network_.layers.size() && !failed_; ++i) {
      Layer& layer = network_.layers[begin + i];
      const Layer& own = network_.layers[first + i];
      if (layer.kind != LayerKind::conv) continue;
      layer.weights_of = own.weights_of > 0 ? own.weights_of : static_cast<int>(first + i) + 1;
      if (channels(layer.input) == channels(own.input) && layer.channels == own.channels) continue;
      refuse(range,
             fmt::format("a pass begins with {}, another one with {}: they cannot share weights",
                         counted(channels(own.input), "channel"), channels(layer.input)),
             "end the body with as many channels as go into it, or write repeat without shared");
    }
  }

  // ---- values ------------------------------------------------------------------------------------------------------
  void read_let(const ast::LetItem& item, SourceRange range, bool inside) {
    if (refuses_values(range, inside)) return;
    if (item.name.name == "in" || item.name.name == "out") {
      return fail("reserved-name", item.name.range, {item.name.name, "value"},
                  item.name.name == "out" ? "write out = ... without let" : "");
    }
    if (values_.contains(item.name.name)) return fail("duplicate", item.name.range, {item.name.name});
    const int value = value_of(item.value);
    values_[item.name.name] = {value, item.name.range, false};
  }

  void read_output(const ast::AssignItem& item, bool inside) {
    if (refuses_values(item.target.range, inside)) return;
    if (item.target.name != "out") {
      return refuse(item.target.range, fmt::format("{} has no let before it", item.target.name),
                    fmt::format("write let {} = ...", item.target.name));
    }
    output_ = value_of(item.value);
  }

  bool refuses_values(SourceRange range, bool inside) {
    if (inside) refuse(range, "a value cannot have a name inside of a block");
    if (output_) refuse(range, "nothing can stand after out = ...");
    return failed_;
  }

  /// v1, or a call of a layer.
  int value_of(const ast::Expr& e) {
    if (failed_) return 0;
    if (const auto* name = std::get_if<ast::Name>(&e->kind)) return named_value(name->name, e.range());
    const auto* call = std::get_if<ast::Call>(&e->kind);
    if (!call) {
      refuse(e.range(), "a value is a name or a layer", "write let v2 = relu(v1)");
      return 0;
    }
    const LayerWord* word = find_word({call->callee, call->callee_range});
    if (!word) return 0;
    const std::size_t count = joins(word->kind) ? 2 : 1;
    std::vector<int> inputs;
    for (const ast::Argument& argument : call->arguments) {
      if (inputs.size() == count || !argument.name.empty()) break;
      inputs.push_back(value_of(argument.value));
    }
    if (!failed_ && inputs.size() < count) {
      fail("wrong-argument-count", e.range(),
           {call->callee, counted(static_cast<int>(count), "value"), std::to_string(inputs.size())},
           joins(word->kind) ? std::string("write ") + word->example
                             : fmt::format("write let v = {}(in, ...)", call->callee));
    }
    if (failed_) return 0;
    const std::vector<ast::Argument> rest(call->arguments.begin() + static_cast<std::ptrdiff_t>(count),
                                          call->arguments.end());
    return add(*word, call->callee_range, e.range(), inputs, rest);
  }

  int named_value(const std::string& name, SourceRange range) {
    if (name == "in") return 0;
    const auto found = values_.find(name);
    if (found != values_.end()) {
      found->second.used = true;
      return found->second.number;
    }
    std::vector<std::string> known{"in"};
    for (const auto& [value, unused] : values_) known.push_back(value);
    fail("unknown-name", range, {name}, did_you_mean(name, known));
    return 0;
  }

  void check_values() {
    if (!failed_ && !output_)
      refuse(source_.name.range, fmt::format("network {} has no output", source_.name.name),
             "write out = and a value at its end");
    for (const auto& [name, value] : values_) {
      if (!failed_ && !value.used) refuse(value.range, fmt::format("nothing uses the value {}", name));
    }
    if (failed_ || *output_ == static_cast<int>(network_.layers.size())) return;
    refuse(last_range_, "the output is not the last of the layers", "write the layer that makes the output last");
  }

  // ---- layers ------------------------------------------------------------------------------------------------------
  const LayerWord* find_word(const ast::Identifier& name) {
    std::vector<std::string> known;
    for (const LayerWord& word : layer_words) {
      if (word.name == name.name) return &word;
      known.emplace_back(word.name);
    }
    const std::string near = nearest_name(name.name.substr(0, 40), known);
    fail("unknown-layer", name.range, {name.name.substr(0, 40)},
         near.empty() ? fmt::format("understood here: {}", fmt::join(known, ", "))
                      : fmt::format("did you mean {}?", near));
    return nullptr;
  }

  /// Number of the value that the layer computes from `inputs`; 0 after a diagnostic.
  int add(const LayerWord& word, SourceRange word_range, SourceRange range, const std::vector<int>& inputs,
          const std::vector<ast::Argument>& arguments) {
    std::vector<ast::Expr> plain;
    LayerOptions options;
    sort_arguments(word, arguments, plain, options);
    const auto [least, most] = least_and_most_arguments(word);
    if (!failed_ && (plain.size() < least || plain.size() > most)) {
      fail("wrong-argument-count", range,
           {std::string(word.name), counted(static_cast<int>(most), "argument"), std::to_string(plain.size())},
           fmt::format("as in {}", word.example));
    }
    if (failed_) return 0;
    if (joins(word.kind)) return join(word.kind, std::string(word.name).c_str(), word_range, inputs[0], inputs[1]);
    Layer layer;
    layer.kind = word.kind;
    layer.input = inputs[0];
    layer.channels = channels(layer.input);
    int result_size = size(layer.input);
    if (word.kind == LayerKind::conv) {
      read_conv(word, plain, options, layer);
      result_size *= layer.stride;
    } else if (word.kind == LayerKind::reorient) {
      failed_ = !read_orientation(options, range, network_.rank(), number_of_, layer, sink_);
    } else if (word.kind == LayerKind::mean_pool || word.kind == LayerKind::max_pool ||
               word.kind == LayerKind::upsample) {
      layer.stride = whole(plain[0], fmt::format("the factor of {}", word.name), 2, most_stride);
      if (!failed_) result_size = resized(word.kind, layer.stride, result_size, range);
    } else {
      layer.activation = word.activation;
      const bool is_leaky = word.kind == LayerKind::activate && word.activation == Activation::leaky_relu;
      if (!plain.empty()) layer.factor = number(plain[0], fmt::format("the number of {}", word.name));
      if (plain.empty() && is_leaky) layer.factor = 0.01;
    }
    return push(layer, result_size, range);
  }

  void sort_arguments(const LayerWord& word, const std::vector<ast::Argument>& arguments, std::vector<ast::Expr>& plain,
                      LayerOptions& options) {
    for (const ast::Argument& argument : arguments) {
      if (argument.name.empty()) {
        plain.push_back(argument.value);
      } else if (const std::vector<std::string> known = options_of(word);
                 std::ranges::find(known, argument.name) == known.end()) {
        fail("unknown-option", argument.name_range, {argument.name, std::string(word.name)},
             known.empty() ? fmt::format("it is written {}", word.example) : did_you_mean(argument.name, known));
      } else if (!options.emplace(argument.name, argument).second) {
        fail("repeated", argument.name_range, {argument.name});
      }
    }
  }

  void read_conv(const LayerWord& word, const std::vector<ast::Expr>& plain, const LayerOptions& options,
                 Layer& layer) {
    const int channels_in = layer.channels;
    layer.channels = channel_count(plain[0], word);
    if (!is_dense(word)) layer.extent = odd_extent(plain[1]);
    layer.init = init_;
    const auto option = [&](const char* name, int most, int& value) {
      const auto found = options.find(name);
      if (found != options.end()) value = whole(found->second.value, name, 1, most);
    };
    option("stride", most_stride, layer.stride);
    option("dilation", most_dilation, layer.dilation);
    option("groups", most_channels, layer.groups);
    for (const auto& [name, argument] : options) {
      if (name == "bias") layer.bias = whole(argument.value, "bias", 0, 1) == 1;
      if (name == "gain") layer.gain = number(argument.value, "the gain");
      if (name == "initial") layer.init = initial(argument.value);
    }
    if (options.contains("weights")) take_weights(options, layer);
    if (failed_ || (channels_in % layer.groups == 0 && layer.channels % layer.groups == 0)) return;
    refuse(options.at("groups").value.range(),
           fmt::format("{} groups do not divide the channels: {} go in, {} come out", layer.groups, channels_in,
                       layer.channels));
  }

  /// weights = v2: shares the weights of another convolution, and their initialisation.
  void take_weights(const LayerOptions& options, Layer& layer) {
    const ast::Expr& e = options.at("weights").value;
    for (const char* own : {"bias", "gain", "initial"}) {
      if (!failed_ && options.contains(own))
        refuse(options.at(own).name_range, fmt::format("{} is that of the weights of the other layer", own),
               "leave it out");
    }
    const auto* name = std::get_if<ast::Name>(&e->kind);
    if (!name)
      refuse(e.range(), "weights are those of a value that has a name",
             "write weights = v1, where let v1 = conv(...) stands above");
    if (failed_) return;
    int value = named_value(name->name, e.range());
    if (value > 0 && network_.layers[static_cast<std::size_t>(value) - 1].weights_of > 0)
      value = network_.layers[static_cast<std::size_t>(value) - 1].weights_of;
    const Layer* const own = value > 0 ? &network_.layers[static_cast<std::size_t>(value) - 1] : nullptr;
    const bool fits = own && own->kind == LayerKind::conv && own->extent == layer.extent &&
                      own->channels == layer.channels && own->groups == layer.groups &&
                      channels(own->input) == channels(layer.input);
    if (!failed_ && !fits)
      refuse(e.range(),
             fmt::format("{} is no convolution with the extent, the channels and the groups of this one", name->name));
    if (failed_) return;
    layer.weights_of = value;
    layer.bias = own->bias;
    layer.gain = own->gain;
    layer.init = own->init;
  }

  int channel_count(const ast::Expr& e, const LayerWord& word) {
    const auto* name = std::get_if<ast::Name>(&e->kind);
    if (name && name->name == "out") return network_.outputs;
    if (name && name->name == "in") return network_.inputs;
    return whole(e, fmt::format("the number of channels of {}", word.name), 1, most_channels);
  }

  int odd_extent(const ast::Expr& e) {
    const int extent = whole(e, "the extent of conv", 1, most_extent);
    if (extent % 2 == 1) return extent;
    const std::string neighbours =
        extent < most_extent - 1 ? fmt::format("write {} or {}", extent - 1, extent + 1) : "";
    refuse(e.range(), fmt::format("an extent of {} has no middle", extent), neighbours);
    return 1;
  }

  network::Init initial(const ast::Expr& e) {
    const auto* name = std::get_if<ast::Name>(&e->kind);
    const auto found = name ? find_init(name->name) : std::nullopt;
    if (!found) refuse(e.range(), "weights begin as he, xavier or zero");
    return found.value_or(network::Init::he);
  }

  int whole(const ast::Expr& e, const std::string& what, int least, int most) {
    const double value = number(e, what);
    if (failed_) return 1;
    if (value >= least && value <= most && value == std::floor(value)) return static_cast<int>(value);
    refuse(e.range(), fmt::format("{} is a whole number from {} to {}, not {}", what, least, most, value));
    return 1;
  }

  double number(const ast::Expr& e, const std::string& what) {
    if (failed_) return 0;
    const auto value = number_of_(e, what);
    failed_ = !value;
    return value.value_or(0);
  }

  int resized(LayerKind kind, int stride, int input, SourceRange range) {
    if (kind != LayerKind::upsample) return input * stride;
    if (input % stride == 0) return input / stride;
    refuse(range,
           fmt::format("upsample {} cannot undo what made the grid here: it is {}", stride,
                       input == 1 ? grid_phrase(1) : grid_phrase(input)),
           input == 1 ? "a pool or a stride before it makes a coarser grid" : fmt::format("write upsample {}", input));
    return input;
  }

  /// add and concat, residual and skip require equal grids; add also equal channels.
  int join(LayerKind kind, const char* word, SourceRange range, int first, int second) {
    const bool is_block = std::string_view(word) == "residual" || std::string_view(word) == "skip";
    if (size(first) != size(second)) {
      const std::string text = is_block ? fmt::format("the body of {} begins on {} and ends on {}", word,
                                                      grid_phrase(size(first)), grid_phrase(size(second)))
                                        : fmt::format("{} has values on {} and on {}", word, grid_phrase(size(first)),
                                                      grid_phrase(size(second)));
      const bool is_coarser = size(second) % size(first) == 0;
      refuse(range, text, is_coarser ? fmt::format("write upsample {} at its end", size(second) / size(first)) : "");
    } else if (kind == LayerKind::add && channels(first) != channels(second)) {
      const std::string text =
          is_block ? fmt::format("the body of residual makes {} of {}", counted(channels(second), "channel"),
                                 channels(first))
                   : fmt::format("add has values of {} and {} channels", channels(first), channels(second));
      refuse(range, text,
             is_block
                 ? fmt::format("end it with conv {}, 1, or write skip to keep the channels of both", channels(first))
                 : "");
    }
    Layer layer;
    layer.kind = kind;
    layer.input = first;
    layer.other = second;
    layer.channels = kind == LayerKind::add ? channels(first) : channels(first) + channels(second);
    return push(layer, size(first), range);
  }

  int push(const Layer& layer, int result_size, SourceRange range) {
    if (!failed_ && network_.layers.size() == most_layers)
      refuse(range, fmt::format("the network has more than {} layers", most_layers));
    if (!failed_ && layer.channels > most_channels)
      refuse(range, fmt::format("this makes {} channels, more than {}", layer.channels, most_channels));
    if (!failed_ && result_size > most_size)
      refuse(range, fmt::format("the grid here is {} times coarser than that of the fields, more than {}", result_size,
                                most_size));
    if (failed_) return 0;
    network_.layers.push_back(layer);
    sizes_.push_back(result_size);
    return static_cast<int>(network_.layers.size());
  }

  /// The result has one channel per output, on the grid of the fields.
  void check_output() {
    const int last = static_cast<int>(network_.layers.size());
    if (last == 0)
      return refuse(source_.name.range, fmt::format("network {} has no layers", source_.name.name),
                    "write conv out, 3 at its end");
    if (size(last) != 1) {
      refuse(last_range_, fmt::format("the network ends on {}", grid_phrase(size(last))),
             fmt::format("write upsample {}", size(last)));
    } else if (channels(last) != network_.outputs) {
      refuse(last_range_,
             fmt::format("the last layer has {}, but the network has {}", counted(channels(last), "channel"),
                         counted(network_.outputs, "output")),
             "end with conv out, 1 or another extent");
    }
  }

  struct Value {
    int number = 0;
    SourceRange range;
    bool used = false;
  };
  static constexpr int most_size = 4096;

  const ast::Network& source_;
  const network::Init init_;
  const NumberOf& number_of_;
  network::Network& network_;
  DiagnosticSink& sink_;
  std::vector<int> sizes_;  // grid of each layer's result
  int current_ = 0;         // input of the next word
  bool as_values_ = false;
  std::map<std::string, Value> values_;
  std::optional<int> output_;
  SourceRange last_range_;
  bool failed_ = false;
};

}  // namespace

std::optional<network::Init> find_init(std::string_view name) {
  for (const network::Init init : {network::Init::he, network::Init::xavier, network::Init::zero}) {
    if (network::name_of(init) == name) return init;
  }
  return std::nullopt;
}

bool add_layers(const ast::Network& source, network::Init init, const NumberOf& number_of, network::Network& network,
                DiagnosticSink& sink) {
  return LayerReader(source, init, number_of, network, sink).run();
}

}  // namespace dpde::model
