// SPDX-License-Identifier: Apache-2.0
#include "support/json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace dpde {

namespace {

using Library = nlohmann::ordered_json;

constexpr int most_levels = 1000;

Library to_library(const Json& json) {
  if (json.is_object()) {
    Library result = Library::object();
    for (const auto& [key, value] : json.items()) result[key] = to_library(value);
    return result;
  }
  if (json.is_array()) {
    Library result = Library::array();
    for (const Json& value : json) result.push_back(to_library(value));
    return result;
  }
  if (json.is_null()) return nullptr;
  if (json.is_string()) return json.get<std::string>();
  if (json.is_whole_number() && json < 0) return json.get<std::int64_t>();
  if (json.is_whole_number()) return json.get<std::uint64_t>();
  if (json.is_number()) return json.get<double>();
  return json.get<bool>();
}

Json from_library(const Library& from, int level) {
  if (level > most_levels) throw JsonError("too deep");
  switch (from.type()) {
    case Library::value_t::boolean: return from.get<bool>();
    case Library::value_t::number_integer: return from.get<std::int64_t>();
    case Library::value_t::number_unsigned: return from.get<std::uint64_t>();
    case Library::value_t::number_float: return from.get<double>();
    case Library::value_t::string: return from.get<std::string>();
    case Library::value_t::array: {
      Json result = Json::array();
      for (const Library& value : from) result.push_back(from_library(value, level + 1));
      return result;
    }
    case Library::value_t::object: {
      Json result = Json::object();
      for (const auto& [key, value] : from.items()) result[key] = from_library(value, level + 1);
      return result;
    }
    case Library::value_t::null:
    case Library::value_t::binary:
    case Library::value_t::discarded: break;
  }
  return nullptr;
}

}  // namespace

Json::Json() : value_(nullptr) {}
Json::Json(std::nullptr_t) : value_(nullptr) {}
void Json::set(std::uint64_t value) {
  if (std::in_range<std::int64_t>(value)) {
    value_ = static_cast<std::int64_t>(value);
  } else {
    value_ = value;
  }
}
Json::Json(double value) : value_(value) {}
Json::Json(const char* text) : value_(std::string(text)) {}
Json::Json(std::string text) : value_(std::move(text)) {}
Json::Json(std::string_view text) : value_(std::string(text)) {}
Json::Json(const Json& other) = default;
Json::Json(Json&& other) noexcept = default;
Json& Json::operator=(Json other) noexcept {
  value_.swap(other.value_);
  return *this;
}
Json::~Json() = default;

Json::Json(std::initializer_list<Json> parts) : value_(nullptr) {
  const bool has_pairs_only = std::ranges::all_of(
      parts, [](const Json& part) { return part.is_array() && part.size() == 2 && part[0].is_string(); });
  if (!has_pairs_only) {
    value_ = std::vector<Json>(parts);
    return;
  }
  value_ = Object();
  for (const Json& part : parts) (*this)[part[0].text()] = part[1];
}

Json Json::array(std::initializer_list<Json> values) {
  Json result;
  result.value_ = std::vector<Json>(values);
  return result;
}

Json Json::object() {
  Json result;
  result.value_ = Object();
  return result;
}

bool Json::is_null() const { return std::holds_alternative<std::nullptr_t>(value_); }
bool Json::is_number() const { return is_whole_number() || std::holds_alternative<double>(value_); }
bool Json::is_whole_number() const {
  return std::holds_alternative<std::int64_t>(value_) || std::holds_alternative<std::uint64_t>(value_);
}
bool Json::is_string() const { return std::holds_alternative<std::string>(value_); }
bool Json::is_array() const { return std::holds_alternative<std::vector<Json>>(value_); }
bool Json::is_object() const { return std::holds_alternative<Object>(value_); }

bool Json::truth() const {
  const bool* value = std::get_if<bool>(&value_);
  if (value == nullptr) throw JsonError(dump() + " is neither true nor false");
  return *value;
}

double Json::number() const {
  if (const double* value = std::get_if<double>(&value_)) return *value;
  if (const std::uint64_t* value = std::get_if<std::uint64_t>(&value_)) return static_cast<double>(*value);
  return static_cast<double>(whole_number());
}

std::int64_t Json::whole_number() const {
  if (const std::int64_t* value = std::get_if<std::int64_t>(&value_)) return *value;
  const double* value = std::get_if<double>(&value_);
  if (value != nullptr && std::abs(*value) < 0x1p63) return static_cast<std::int64_t>(*value);
  throw JsonError(dump() + (is_number() ? " is too large" : " is no number"));
}

std::uint64_t Json::unsigned_number() const {
  if (const std::uint64_t* value = std::get_if<std::uint64_t>(&value_)) return *value;
  const std::int64_t value = whole_number();
  if (value < 0) throw JsonError(dump() + " is negative");
  return static_cast<std::uint64_t>(value);
}

const std::string& Json::text() const {
  const std::string* value = std::get_if<std::string>(&value_);
  if (value == nullptr) throw JsonError(dump() + " is no text");
  return *value;
}

const std::vector<Json>& Json::elements() const {
  const auto* values = std::get_if<std::vector<Json>>(&value_);
  return values != nullptr ? *values : members().values;
}

const Json::Object& Json::members() const {
  const Object* object = std::get_if<Object>(&value_);
  if (object == nullptr) throw JsonError(dump() + " is neither an array nor an object");
  return *object;
}

Json& Json::operator[](const std::string& key) & {
  if (is_null()) value_ = Object();
  Object* object = std::get_if<Object>(&value_);
  if (object == nullptr) throw JsonError(dump() + " is no object");
  const auto found = std::ranges::find(object->keys, key);
  const auto index = found - object->keys.begin();
  if (found == object->keys.end()) {
    object->keys.push_back(key);
    object->values.emplace_back();
  }
  return object->values[static_cast<std::size_t>(index)];
}

const Json& Json::at(const std::string& key) const& {
  const Object& object = members();
  const auto found = std::ranges::find(object.keys, key);
  if (found == object.keys.end()) throw JsonError(dump() + " has no key " + key);
  return object.values[static_cast<std::size_t>(found - object.keys.begin())];
}

bool Json::contains(const std::string& key) const {
  const Object* object = std::get_if<Object>(&value_);
  return object != nullptr && std::ranges::find(object->keys, key) != object->keys.end();
}

const Json& Json::operator[](std::size_t index) const& {
  if (index >= elements().size()) throw JsonError(dump() + " has too few elements");
  return elements()[index];
}
Json& Json::operator[](std::size_t index) & { return const_cast<Json&>(std::as_const(*this)[index]); }

void Json::update(const Json& other) {
  for (const auto& [key, value] : other.items()) (*this)[key] = value;
}

void Json::push_back(Json value) {
  if (is_null()) value_ = std::vector<Json>();
  auto* values = std::get_if<std::vector<Json>>(&value_);
  if (values == nullptr) throw JsonError(dump() + " is no array");
  values->push_back(std::move(value));
}

std::size_t Json::size() const { return is_array() || is_object() ? elements().size() : is_null() ? 0 : 1; }

std::vector<Json>::iterator Json::begin() { return const_cast<std::vector<Json>&>(elements()).begin(); }
std::vector<Json>::iterator Json::end() { return const_cast<std::vector<Json>&>(elements()).end(); }

std::vector<Json::Item<const Json>> Json::items() const& {
  std::vector<Item<const Json>> result;
  const Object& object = members();
  for (std::size_t i = 0; i < object.keys.size(); ++i) result.push_back({object.keys[i], object.values[i]});
  return result;
}

std::vector<Json::Item<Json>> Json::items() & {
  std::vector<Item<Json>> result;
  Object& object = const_cast<Object&>(members());
  for (std::size_t i = 0; i < object.keys.size(); ++i) result.push_back({object.keys[i], object.values[i]});
  return result;
}

bool operator==(const Json& a, const Json& b) {
  if (a.is_object() && b.is_object()) {
    return a.size() == b.size() && std::ranges::all_of(a.items(), [&](const auto& item) {
             return b.contains(item.key) && b.at(item.key) == item.value;
           });
  }
  if (a.is_array() && b.is_array()) return a.elements() == b.elements();
  return (a <=> b) == std::partial_ordering::equivalent;
}

std::partial_ordering operator<=>(const Json& a, const Json& b) {
  if (a.is_number() && b.is_number()) {
    const bool are_small =
        std::holds_alternative<std::int64_t>(a.value_) && std::holds_alternative<std::int64_t>(b.value_);
    if (are_small) return a.whole_number() <=> b.whole_number();
    return a.number() <=> b.number();
  }
  if (a.is_string() && b.is_string()) return a.text() <=> b.text();
  if (a.value_.index() != b.value_.index()) return std::partial_ordering::unordered;
  if (a.is_null()) return std::partial_ordering::equivalent;
  if (const bool* truth = std::get_if<bool>(&a.value_)) return *truth <=> b.truth();
  return std::partial_ordering::unordered;
}

std::string Json::dump(int indent) const {
  return to_library(*this).dump(indent, ' ', false, Library::error_handler_t::replace);
}

std::optional<Json> parse_json(const std::string& text) {
  const Library parsed = Library::parse(text, nullptr, false);
  if (parsed.is_discarded()) return std::nullopt;
  try {
    return from_library(parsed, 0);
  } catch (const JsonError&) {
    return std::nullopt;
  }
}

Json json_number(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  return value;
}

Json json_numbers(const std::vector<double>& values) {
  Json result = Json::array();
  for (const double value : values) result.push_back(json_number(value));
  return result;
}

}  // namespace dpde
