// SPDX-License-Identifier: Apache-2.0
// Weights files: chooses the format, and lists the arrays of a network.
#include "dpde/runtime/weights_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>
#include <string_view>

#include "dpde/runtime/atomic_file.h"
#include "dpde/runtime/error.h"
#include "files/read_file.h"
#include "files/weight_formats.h"

namespace dpde {
namespace {

[[noreturn]] void refuse(const std::string& file, const std::string& what) {
  throw Error(ErrorKind::input, fmt::format("{} is not a usable file of weights: {}", file, what));
}

bool is_npz(const std::string& name) {
  if (name.ends_with(".npz")) return true;
  if (!name.ends_with(".safetensors")) refuse(name, "its name ends neither with .safetensors nor with .npz");
  return false;
}

std::size_t count_of(const std::vector<int64_t>& shape) {
  std::size_t count = 1;
  for (const int64_t size : shape) count *= static_cast<std::size_t>(size);
  return count;
}

/// An array of a network: its name after "<network>.", its shape, and its begin among the weights.
struct WeightsPlace {
  std::string name;
  std::vector<int64_t> shape;
  int64_t begin;
};

std::vector<WeightsPlace> places_of(const dpde_network& network) {
  if (network.is_host != 0) return {{"weights", {network.weight_count}, 0}};
  std::vector<int64_t> channels{network.inputs};
  std::vector<WeightsPlace> places;
  for (int32_t l = 0; l < network.layer_count; ++l) {
    const dpde_layer& layer = network.layers[l];
    channels.push_back(layer.channels);
    const auto has_begun = [&](const WeightsPlace& place) {
      return place.begin == layer.weights;
    };  // weights shared by several layers
    if (layer.kind != DPDE_CONV || std::ranges::any_of(places, has_begun)) continue;
    WeightsPlace weight{fmt::format("v{}.weight", l + 1),
                        {layer.channels, channels[static_cast<std::size_t>(layer.input)] / std::max(layer.groups, 1)},
                        layer.weights};
    weight.shape.insert(weight.shape.end(), static_cast<std::size_t>(network.rank), layer.extent);
    places.push_back(std::move(weight));
    if (layer.bias >= 0) places.push_back({fmt::format("v{}.bias", l + 1), {layer.channels}, layer.bias});
  }
  return places;
}

/// The network's own name if an array has it as prefix, else the prefix that all arrays share.
std::string prefix_in(const dpde_network& network, std::span<const NamedArray> arrays) {
  const std::string own = std::string(network.name) + ".";
  std::string shared;
  for (const NamedArray& array : arrays) {
    if (array.name.starts_with(own)) return own;
    const std::string prefix = array.name.substr(0, array.name.find('.') + 1);
    if (!shared.empty() && prefix != shared) return own;
    shared = prefix;
  }
  return shared.empty() ? own : shared;
}

/// The number in "<number>.weight" and "<number>.bias"; empty for other names.
std::optional<int64_t> number_in(const std::string& name) {
  int64_t number = 0;
  const char* const end = name.data() + name.size();
  const auto [behind, error] = std::from_chars(name.data(), end, number);
  const std::string_view rest(behind, static_cast<std::size_t>(end - behind));
  const bool is_one = error == std::errc() && number >= 0 && (rest == ".weight" || rest == ".bias");
  return is_one ? std::optional(number) : std::nullopt;
}

/// The names of a network's arrays in a file.
class ArrayNames {
 public:
  ArrayNames(const dpde_network& network, std::span<const NamedArray> arrays) : prefix_(prefix_in(network, arrays)) {
    std::set<int64_t> numbers;
    for (const NamedArray& array : arrays) {
      const std::optional<int64_t> number = number_in(array.name);
      if (number) numbers.insert(*number);
      if (array.name.starts_with(prefix_)) return;  // the file uses dpde's own names
    }
    numbers_.assign(numbers.begin(), numbers.end());
  }

  bool are_numbers() const { return !numbers_.empty(); }
  const std::string& prefix() const { return prefix_; }
  /// `layer`: index among those that have weights, from 0 on.
  std::string of(const WeightsPlace& place, std::size_t layer) const {
    if (numbers_.empty() || layer >= numbers_.size()) return prefix_ + place.name;
    return fmt::format("{}{}", numbers_[layer], place.name.substr(place.name.find('.')));
  }
  bool is_own(const NamedArray& array) const {
    if (!array.other_type.empty()) return false;
    return are_numbers() ? number_in(array.name).has_value() : array.name.starts_with(prefix_);
  }

 private:
  std::string prefix_;
  std::vector<int64_t> numbers_;  // the layers' numbers, in their order
};

}  // namespace

std::vector<NamedArray> parse_weights(std::string_view bytes, const std::string& name) {
  return is_npz(name) ? parse_npz(bytes, name) : parse_safetensors(bytes, name);
}

std::vector<NamedArray> read_weights(const std::filesystem::path& path) {
  is_npz(path.string());  // throws for an unknown ending before anything is read
  return parse_weights(read_file(path), path.string());
}

void write_weights(const std::filesystem::path& path, std::span<const NamedArray> arrays, bool is_single) {
  const bool zipped = is_npz(path.string());
  for (const NamedArray& array : arrays) {
    if (count_of(array.shape) == array.values.size()) continue;
    throw Error(ErrorKind::input, fmt::format("{} values of {} do not have the shape ({})", array.values.size(),
                                              array.name, fmt::join(array.shape, ", ")));
  }
  write_file_atomically(path, zipped ? compose_npz(arrays, is_single) : compose_safetensors(arrays, is_single));
}

std::vector<NamedArray> arrays_of(const dpde_network& network, std::span<const double> weights) {
  if (static_cast<int64_t>(weights.size()) != network.weight_count) {
    throw Error(ErrorKind::input,
                fmt::format("network {} has {} weights, not {}", network.name, network.weight_count, weights.size()));
  }
  std::vector<NamedArray> arrays;
  for (const WeightsPlace& place : places_of(network)) {
    const auto values = weights.subspan(static_cast<std::size_t>(place.begin), count_of(place.shape));
    arrays.push_back({fmt::format("{}.{}", network.name, place.name), place.shape, {values.begin(), values.end()}});
  }
  return arrays;
}

std::vector<double> weights_of(const dpde_network& network, std::span<const NamedArray> arrays,
                               const std::string& file) {
  std::vector<double> weights(static_cast<std::size_t>(network.weight_count));
  const ArrayNames names(network, arrays);
  std::size_t used = 0, layers = 0;
  for (const WeightsPlace& place : places_of(network)) {
    if (!place.name.ends_with(".bias")) ++layers;
    const std::string name = names.of(place, layers - 1);
    const auto array = std::ranges::find(arrays, name, &NamedArray::name);
    if (array == arrays.end()) {
      std::vector<std::string> others;
      for (const NamedArray& each : arrays) others.push_back(each.name);
      refuse(file, fmt::format("network {} needs an array {}; it has {}", network.name, name,
                               others.empty() ? "none" : fmt::format("{}", fmt::join(others, ", "))));
    }
    if (!array->other_type.empty())
      refuse(file, fmt::format("the numbers of {} are of type {}; F64, F32, F16 and BF16 are supported", name,
                               array->other_type));
    if (array->shape != place.shape) {
      refuse(file, fmt::format("{} has the shape ({}), network {} needs ({})", array->name,
                               fmt::join(array->shape, ", "), network.name, fmt::join(place.shape, ", ")));
    }
    const auto bad = std::ranges::find_if_not(array->values, [](double value) { return std::isfinite(value); });
    if (bad != array->values.end())
      refuse(file, fmt::format("value {} of {} is {}", bad - array->values.begin(), array->name, *bad));
    std::ranges::copy(array->values, weights.begin() + place.begin);
    ++used;
  }
  const auto mine = std::ranges::count_if(arrays, [&](const NamedArray& array) { return names.is_own(array); });
  if (static_cast<std::size_t>(mine) != used)
    refuse(file, fmt::format("it has {} arrays called {}*, network {} has {}: they are the weights of another network",
                             mine, names.are_numbers() ? "" : names.prefix(), network.name, used));
  return weights;
}

}  // namespace dpde
