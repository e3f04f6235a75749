// SPDX-License-Identifier: Apache-2.0
// The .safetensors format: eight bytes with the length of the header, the header (JSON), the numbers of all arrays one
// after the other. https://huggingface.co/docs/safetensors
//
// Nothing in the file is trusted: every length is compared with the actual size before anything is allocated.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <optional>

#include "dpde/runtime/error.h"
#include "files/header_text.h"
#include "files/weight_formats.h"

namespace dpde {
namespace {

static_assert(std::endian::native == std::endian::little);
constexpr std::size_t length_bytes = 8;

struct TensorEntry {
  std::string type;
  std::vector<int64_t> shape, offsets;
};

/// Reads the header: {"name": {"dtype": "F32", "shape": [2, 3], "data_offsets": [0, 24]}, "__metadata__": {"key":
/// "text"}}
class SafetensorsHeaderReader : public HeaderText {
 public:
  SafetensorsHeaderReader(std::string_view text, const std::string& file) : HeaderText(text, file, ".safetensors") {}

  std::vector<std::pair<std::string, TensorEntry>> read() {
    std::vector<std::pair<std::string, TensorEntry>> entries;
    for_each_member([&](const std::string& key) {
      if (key == "__metadata__") {
        for_each_member([&](const std::string&) { text(); });
      } else {
        entries.emplace_back(key, entry(key));
      }
    });
    return entries;
  }

 private:
  template <class Visit>
  void for_each_member(const Visit& visit) {
    expect('{');
    if (accept('}')) return;
    do {
      const std::string key = text();
      expect(':');
      visit(key);
    } while (accept(','));
    expect('}');
  }

  std::string text() {
    expect('"');
    std::string content;
    while (!text_.empty() && text_.front() != '"') {
      const char c = text_.front();
      text_.remove_prefix(1);
      if (c == '\\') {
        add_escaped(content);
      } else {
        content += c;
      }
    }
    if (text_.empty()) fail("its header lacks a '\"'");
    text_.remove_prefix(1);
    return content;
  }
  void add_escaped(std::string& content) {
    constexpr std::string_view written = "\"\\/bfnrtu", meant = "\"\\/\b\f\n\r\t";
    const std::size_t which = text_.empty() ? std::string_view::npos : written.find(text_.front());
    if (which == std::string_view::npos) fail("its header has a text with an escape that JSON does not know");
    text_.remove_prefix(1);
    if (which < meant.size()) {
      content += meant[which];
    } else {
      add_utf8(content, code_point());
    }
  }
  /// Parses the code point after "\u": one of the basic plane, or a surrogate pair.
  uint32_t code_point() {
    const uint32_t first = four_digits();
    if (first < 0xd800 || first > 0xdfff) return first;
    if (first > 0xdbff || !text_.starts_with("\\u")) fail("its header has half of a \\u escape of two");
    text_.remove_prefix(2);
    const uint32_t second = four_digits();
    if (second < 0xdc00 || second > 0xdfff) fail("its header has half of a \\u escape of two");
    return 0x10000 + ((first - 0xd800) << 10) + (second - 0xdc00);
  }
  uint32_t four_digits() {
    uint32_t value = 0;
    const char* const end = text_.data() + std::min<std::size_t>(4, text_.size());
    const auto [last, error] = std::from_chars(text_.data(), end, value, 16);
    if (error != std::errc() || last != text_.data() + 4) fail("its header has a \\u escape without four digits");
    text_.remove_prefix(4);
    return value;
  }
  static void add_utf8(std::string& content, uint32_t code) {
    const auto add = [&](uint32_t byte) { content += static_cast<char>(byte); };
    if (code < 0x80) {
      add(code);
      return;
    }
    const int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;  // continuation bytes, six bits each
    add((0xff00U >> (more + 1) & 0xffU) | code >> (6 * more));   // a 1 bit for each byte, a 0, the highest bits
    for (int i = more; i-- > 0;) add(0x80 | (code >> (6 * i) & 0x3f));
  }

  std::vector<int64_t> sizes(const std::string& of) {
    std::vector<int64_t> values;
    expect('[');
    if (accept(']')) return values;
    do {
      const std::optional<int64_t> value = size();
      if (!value || values.size() == most_axes)
        fail(fmt::format("the entry of {} has a list that is none of sizes", of));
      values.push_back(*value);
    } while (accept(','));
    expect(']');
    return values;
  }

  TensorEntry entry(const std::string& name) {
    TensorEntry entry;
    for_each_member([&](const std::string& key) {
      if (key == "dtype") {
        entry.type = text();
      } else if (key == "shape") {
        entry.shape = sizes(name);
      } else if (key == "data_offsets") {
        entry.offsets = sizes(name);
      } else {
        fail(fmt::format("the entry of {} has an unknown key {}", name, key.substr(0, 40)));
      }
    });
    if (entry.offsets.size() != 2 || entry.offsets[0] > entry.offsets[1])
      fail(fmt::format("the entry of {} has no data_offsets", name));
    return entry;
  }
};

template <class Number>
std::vector<double> numbers(std::string_view data) {
  std::vector<Number> raw(data.size() / sizeof(Number));
  if (!data.empty()) std::memcpy(static_cast<void*>(raw.data()), data.data(), data.size());
  std::vector<double> values;
  for (const Number number : raw) values.push_back(static_cast<double>(number));
  return values;
}

/// How numbers of a type are read.
struct NumberType {
  std::string_view name;
  std::size_t bytes;
  std::vector<double> (*read)(std::string_view data);
};
constexpr NumberType number_types[] = {{"F64", 8, numbers<double>},
                                       {"F32", 4, numbers<float>},
                                       {"F16", 2, numbers<Eigen::half>},
                                       {"BF16", 2, numbers<Eigen::bfloat16>}};

NamedArray array_of(const SafetensorsHeaderReader& reader, const std::string& name, const TensorEntry& entry,
                    std::string_view data) {
  const auto* const type = std::ranges::find(number_types, entry.type, &NumberType::name);
  const auto begin = static_cast<std::size_t>(entry.offsets[0]), end = static_cast<std::size_t>(entry.offsets[1]);
  if (end > data.size())
    reader.fail(fmt::format("{} ends at byte {} of {}: the file was cut off", name, end, data.size()));
  if (type == std::end(number_types)) return {name, entry.shape, {}, entry.type.substr(0, 40)};
  std::size_t count = type->bytes;
  for (const int64_t size : entry.shape) {
    if (__builtin_mul_overflow(count, static_cast<std::size_t>(size), &count))
      reader.fail(fmt::format("the shape of {} is too large", name));
  }
  if (count != end - begin)
    reader.fail(
        fmt::format("{} bytes of {} do not fit its shape ({})", end - begin, name, fmt::join(entry.shape, ", ")));
  return {name, entry.shape, type->read(data.substr(begin, count))};
}

/// The format requires that every byte belongs to exactly one entry.
void check_bytes_are_used_once(const SafetensorsHeaderReader& reader,
                               const std::vector<std::pair<std::string, TensorEntry>>& entries, std::size_t bytes) {
  std::vector<std::pair<std::vector<int64_t>, std::string>> parts;
  for (const auto& [name, entry] : entries) parts.emplace_back(entry.offsets, name);
  std::ranges::sort(parts);
  int64_t end = 0;
  for (const auto& [offsets, name] : parts) {
    if (offsets[0] < end)
      reader.fail(fmt::format("{} begins at byte {}, inside the entry before it", name, offsets[0]));
    if (offsets[0] > end) reader.fail(fmt::format("its bytes {} to {} belong to no entry", end, offsets[0]));
    end = offsets[1];
  }
  if (static_cast<std::size_t>(end) < bytes)
    reader.fail(fmt::format("{} bytes follow its last entry", bytes - static_cast<std::size_t>(end)));
}

std::string quoted(const std::string& name) {
  std::string text = "\"";
  for (const char c : name) {
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  return text + '"';
}

}  // namespace

std::vector<NamedArray> parse_safetensors(std::string_view bytes, const std::string& name) {
  uint64_t length = 0;
  const SafetensorsHeaderReader nothing({}, name);
  if (bytes.size() < length_bytes) nothing.fail("it ends before its header");
  std::memcpy(&length, bytes.data(), length_bytes);
  if (length > bytes.size() - length_bytes) nothing.fail("it ends inside its header");
  SafetensorsHeaderReader reader(bytes.substr(length_bytes, length), name);
  const std::string_view data = bytes.substr(length_bytes + length);
  std::vector<NamedArray> arrays;
  const auto entries = reader.read();
  check_bytes_are_used_once(reader, entries, data.size());  // before memory is allocated for the stated sizes
  for (const auto& [key, entry] : entries) arrays.push_back(array_of(reader, key, entry, data));
  return arrays;
}

std::string compose_safetensors(std::span<const NamedArray> arrays, bool is_single) {
  const std::size_t bytes = is_single ? 4 : 8;
  std::string header = "{", data;
  for (const NamedArray& array : arrays) {
    const std::size_t begin = data.size();
    if (is_single) {
      const std::vector<float> rounded(array.values.begin(), array.values.end());
      data.append(reinterpret_cast<const char*>(rounded.data()), rounded.size() * bytes);
    } else {
      data.append(reinterpret_cast<const char*>(array.values.data()), array.values.size() * bytes);
    }
    header +=
        fmt::format(R"({}{}:{{"dtype":"{}","shape":[{}],"data_offsets":[{},{}]}})", header.size() > 1 ? "," : "",
                    quoted(array.name), is_single ? "F32" : "F64", fmt::join(array.shape, ","), begin, data.size());
  }
  header += '}';
  header.append((8 - header.size() % 8) % 8, ' ');  // the numbers begin at a multiple of eight bytes
  const auto length = std::bit_cast<std::array<char, length_bytes>>(static_cast<uint64_t>(header.size()));
  return std::string(length.data(), length.size()) + header + data;
}

}  // namespace dpde
