// SPDX-License-Identifier: Apache-2.0
// A JSON value, for input and output of the command. Only json.cpp uses the JSON library, whose templates take seconds
// to compile in every file that includes them.
#pragma once

#include <compare>
#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace dpde {

/// A value has another kind than requested, or a key or an index does not exist.
struct JsonError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// null, true or false, a number, a text, an array, or an object with keys in insertion order.
class Json {
 public:
  Json();  // null
  Json(std::nullptr_t);
  template <std::same_as<bool> T>
  Json(T value) : value_(value) {}
  template <std::signed_integral T>
  Json(T value) : value_(static_cast<std::int64_t>(value)) {}
  template <std::unsigned_integral T>
  requires(!std::same_as<T, bool>) Json(T value) { set(value); }
  Json(double value);
  Json(const char* text);
  Json(std::string text);
  Json(std::string_view text);
  Json(const Json& other);
  Json(Json&& other) noexcept;
  /// Takes its argument by value: `json["a"] = json["b"]` copies b before it inserts a.
  Json& operator=(Json other) noexcept;
  ~Json();
  template <class T>
  Json(const std::vector<T>& values) : Json(array()) {
    for (const T& value : values) push_back(value);
  }
  template <class T>
  Json(const std::map<std::string, T>& values) : Json(object()) {
    for (const auto& [key, value] : values) (*this)[key] = value;
  }
  /// An object if all parts are pairs of a text and a value; otherwise an array.
  Json(std::initializer_list<Json> parts);
  static Json array(std::initializer_list<Json> values = {});
  static Json object();

  bool is_null() const;
  bool is_number() const;
  bool is_whole_number() const;
  bool is_string() const;
  bool is_array() const;
  bool is_object() const;

  /// bool, a number, std::string, or a vector of these. Converting to an integer truncates.
  template <class T>
  T get() const {
    if constexpr (std::same_as<T, bool>) {
      return truth();
    } else if constexpr (std::same_as<T, std::uint64_t>) {
      return unsigned_number();
    } else if constexpr (std::integral<T>) {
      return static_cast<T>(whole_number());
    } else if constexpr (std::floating_point<T>) {
      return static_cast<T>(number());
    } else if constexpr (std::same_as<T, std::string>) {
      return text();
    } else {
      T values;
      for (const Json& value : elements()) values.push_back(value.get<typename T::value_type>());
      return values;
    }
  }
  template <class T>
  requires((std::is_arithmetic_v<T> && !std::same_as<T, char>) || std::same_as<T, std::string>) operator T() const {
    return get<T>();
  }

  /// Elements of an array, values of an object. null becomes an array by push_back, an object by a key. Access to a
  /// temporary returns a copy.
  Json& operator[](const std::string& key) &;
  const Json& operator[](const std::string& key) const& { return at(key); }
  Json operator[](const std::string& key) && { return std::move((*this)[key]); }
  Json& operator[](const char* key) & { return (*this)[std::string(key)]; }
  const Json& operator[](const char* key) const& { return at(key); }
  Json operator[](const char* key) && { return std::move((*this)[key]); }
  Json& operator[](std::size_t index) &;
  const Json& operator[](std::size_t index) const&;
  Json operator[](std::size_t index) && { return std::move((*this)[index]); }
  Json& operator[](int index) & { return (*this)[static_cast<std::size_t>(index)]; }
  const Json& operator[](int index) const& { return (*this)[static_cast<std::size_t>(index)]; }
  Json operator[](int index) && { return std::move((*this)[index]); }
  const Json& at(const std::string& key) const&;
  bool contains(const std::string& key) const;
  template <class T>
  T value(const std::string& key, T otherwise) const {
    return contains(key) ? at(key).get<T>() : otherwise;
  }
  /// Sets all keys of `other`, an object.
  void update(const Json& other);
  void push_back(Json value);
  std::size_t size() const;
  bool empty() const { return size() == 0; }
  const Json& front() const& { return (*this)[0]; }
  Json front() && { return std::move((*this)[0]); }
  const Json& back() const& { return (*this)[size() - 1]; }
  Json& back() & { return (*this)[size() - 1]; }
  Json back() && { return std::move((*this)[size() - 1]); }
  std::vector<Json>::iterator begin();
  std::vector<Json>::iterator end();
  std::vector<Json>::const_iterator begin() const { return elements().begin(); }
  std::vector<Json>::const_iterator end() const { return elements().end(); }

  template <class Value>
  struct Item {
    const std::string& key;
    Value& value;
  };
  /// The keys and values of an object.
  std::vector<Item<Json>> items() &;
  std::vector<Item<const Json>> items() const&;
  void items() && = delete;

  /// One line, or indented by `indent` blanks for each level. Bytes that are not UTF-8 are replaced.
  std::string dump(int indent = -1) const;

  /// Objects are equal for any order of their keys. Numbers compare by value; arrays and objects are unordered.
  friend bool operator==(const Json& a, const Json& b);
  friend std::partial_ordering operator<=>(const Json& a, const Json& b);
  template <class T>
  requires std::is_arithmetic_v<T>
  friend bool operator==(const Json& a, T b) { return a == Json(b); }
  template <class T>
  requires std::is_arithmetic_v<T>
  friend std::partial_ordering operator<=>(const Json& a, T b) { return a <=> Json(b); }
  friend std::ostream& operator<<(std::ostream& out, const Json& json) { return out << json.dump(); }

 private:
  struct Object {
    std::vector<std::string> keys;
    std::vector<Json> values;
  };
  void set(std::uint64_t value);
  bool truth() const;
  double number() const;
  std::int64_t whole_number() const;
  std::uint64_t unsigned_number() const;
  const std::string& text() const;
  const std::vector<Json>& elements() const;
  const Object& members() const;

  std::variant<std::nullptr_t, bool, std::int64_t, std::uint64_t, double, std::string, std::vector<Json>, Object>
      value_;  // std::uint64_t: only for values beyond std::int64_t
};

/// Parses a text; nullopt if it is not JSON, or nested deeper than a thousand levels.
std::optional<Json> parse_json(const std::string& text);

/// A number, or "nan", "inf" or "-inf", which JSON cannot express as numbers.
Json json_number(double value);
Json json_numbers(const std::vector<double>& values);

}  // namespace dpde
