// SPDX-License-Identifier: Apache-2.0
// Weight files: bytes in their formats, invalid bytes, and arrays that do not fit a network.
#include "dpde/runtime/weights_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <functional>

#include "dpde/runtime/error.h"
#include "dpde/runtime/npy.h"

namespace dpde {
namespace {

std::string little(uint64_t value, int count) {
  std::string bytes;
  for (int i = 0; i < count; ++i) bytes += i < 8 ? static_cast<char>(value >> (8 * i) & 0xff) : char{0};
  return bytes;
}

template <class Number>
std::string raw(std::initializer_list<Number> values) {
  std::string bytes;
  for (const Number value : values) {
    const auto each = std::bit_cast<std::array<char, sizeof(Number)>>(value);
    bytes.append(each.data(), each.size());
  }
  return bytes;
}

std::string safetensors(const std::string& header, const std::string& data) {
  return little(header.size(), 8) + header + data;
}

std::string message(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    return error.what();
  }
  return "";
}

std::string message_of(const std::string& bytes, const std::string& name) {
  return message([&] { parse_weights(bytes, name); });
}

/// One entry of a zip archive, followed by the directory. `crc` was computed by a known program.
std::string zip_of(const std::string& name, const std::string& content, uint32_t crc, int method = 0) {
  const std::string common = little(20, 2) + little(0, 2) + little(static_cast<uint64_t>(method), 2) + little(0, 2) +
                             little(0x21, 2) + little(crc, 4) + little(content.size(), 4) + little(content.size(), 4) +
                             little(name.size(), 2);
  // NumPy's local headers have an extra field, the directory has none.
  const std::string local = "PK\x03\x04" + common + little(4, 2) + name + std::string("\x01\x00\x00\x00", 4) + content;
  const std::string list = "PK\x01\x02" + little(20, 2) + common + little(0, 2) + little(0, 10) + little(0, 4) + name;
  return local + list + "PK\x05\x06" + little(0, 4) + little(1, 2) + little(1, 2) + little(list.size(), 4) +
         little(local.size(), 4) + little(0, 2);
}

struct TempFolder {
  std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / "dpde_weights";
  TempFolder() { std::filesystem::create_directories(path); }
  ~TempFolder() { std::filesystem::remove_all(path); }
};

TEST(WeightsFile, ReadsSafetensors) {
  const std::string header =
      R"({"__metadata__": {"format": "pt"}, "a.weight":{"dtype":"F32","shape":[2,1],"data_offsets":[0,8]}, "b\"x" : {"shape" : [], "dtype":"F64","data_offsets":[8,16]}} )";
  const std::vector<NamedArray> arrays =
      parse_weights(safetensors(header, raw<float>({1.5F, -2}) + raw<double>({0.1})), "w.safetensors");
  ASSERT_EQ(arrays.size(), 2U);
  EXPECT_EQ(arrays[0].name, "a.weight");
  EXPECT_EQ(arrays[0].shape, (std::vector<int64_t>{2, 1}));
  EXPECT_EQ(arrays[0].values, (std::vector<double>{1.5, -2}));
  EXPECT_EQ(arrays[1].name, "b\"x");
  EXPECT_TRUE(arrays[1].shape.empty());
  EXPECT_EQ(arrays[1].values, std::vector<double>{0.1});
}

TEST(WeightsFile, SafetensorsThatAreNone) {
  const std::string file = "w.safetensors";
  const auto entry = [](const std::string& text, const std::string& data) {
    return safetensors("{\"a\":{" + text + "}}", data);
  };
  EXPECT_EQ(message_of("abc", file), "w.safetensors is not a usable .safetensors file: it ends before its header");
  EXPECT_EQ(message_of(little(100, 8) + "{}", file),
            "w.safetensors is not a usable .safetensors file: it ends inside its header");
  EXPECT_EQ(message_of(little(~0ULL, 8), file),
            "w.safetensors is not a usable .safetensors file: it ends inside its header");
  EXPECT_NE(message_of(safetensors("[]", ""), file).find("its header lacks a '{'"), std::string::npos);
  EXPECT_NE(message_of(safetensors("{\"a\":{", ""), file).find("its header lacks a '\"'"), std::string::npos);
  EXPECT_EQ(parse_weights(entry(R"("dtype":"F8_E5M2","shape":[1],"data_offsets":[0,1])", "a"), file)[0].other_type,
            "F8_E5M2");
  EXPECT_NE(message_of(entry(R"("dtype":"F32","shape":[2],"data_offsets":[0,8])", raw<float>({1})), file)
                .find("a ends at byte 8 of 4: the file was cut off"),
            std::string::npos);
  EXPECT_NE(message_of(entry(R"("dtype":"F32","shape":[3],"data_offsets":[0,8])", raw<float>({1, 2})), file)
                .find("8 bytes of a do not fit its shape (3)"),
            std::string::npos);
  EXPECT_NE(message_of(entry(R"("dtype":"F32","shape":[4611686018427387904,4],"data_offsets":[0,0])", ""), file)
                .find("the shape of a is too large"),
            std::string::npos);
  EXPECT_NE(message_of(entry(R"("dtype":"F32","shape":[-1],"data_offsets":[0,0])", ""), file)
                .find("a list that is none of sizes"),
            std::string::npos);
  EXPECT_NE(message_of(entry(R"("dtype":"F32","shape":[1])", ""), file).find("no data_offsets"), std::string::npos);
  const auto two = [](int first, int second, int count) {
    const auto one = [](const std::string& name, int begin) {
      return "\"" + name + R"(":{"dtype":"F32","shape":[1],"data_offsets":[)" + std::to_string(begin) + "," +
             std::to_string(begin + 4) + "]}";
    };
    return safetensors("{" + one("a", first) + "," + one("b", second) + "}",
                       std::string(static_cast<std::size_t>(count), '\0'));
  };
  EXPECT_EQ(message_of(two(0, 4, 8), file), "");
  EXPECT_EQ(message_of(two(4, 0, 8), file), "");
  EXPECT_NE(message_of(two(0, 0, 4), file).find("b begins at byte 0, inside the entry before it"), std::string::npos);
  EXPECT_NE(message_of(two(0, 2, 6), file).find("b begins at byte 2, inside the entry before it"), std::string::npos);
  EXPECT_NE(message_of(two(0, 8, 12), file).find("its bytes 4 to 8 belong to no entry"), std::string::npos);
  EXPECT_NE(message_of(two(0, 4, 9), file).find("1 bytes follow its last entry"), std::string::npos);
}

TEST(WeightsFile, SafetensorsWithEscapes) {
  const auto name_of = [](const std::string& written) {
    const std::string header = R"({"__metadata__":{"of":"gr\u00f6\u00dfe \ud83d\ude00"},")" + written +
                               R"(":{"dtype":"F32","shape":[],"data_offsets":[0,4]}})";
    return parse_weights(safetensors(header, raw<float>({1})), "w.safetensors").at(0).name;
  };
  EXPECT_EQ(name_of(R"(a\\u0041\\n)"), R"(a\u0041\n)") << "a backslash, not an escape of a letter";
  EXPECT_EQ(name_of(R"(a\u0041\n)"), "aA\n");
  EXPECT_EQ(name_of(R"(\u00e9\u20ac)"), "\u00e9\u20ac");
  EXPECT_EQ(name_of(R"(\ud83d\ude00)"), "\U0001F600");
  for (const char* wrong :
       {R"(\u12)", R"(\u12g4)", R"(\ud83d)", R"(\ud83dx)", R"(\ud83d\u0041)", R"(\ude00)", R"(\x41)"})
    EXPECT_NE(message([&] { name_of(wrong); }).find("escape"), std::string::npos) << wrong;
}

TEST(WeightsFile, ReadsNpzAsNumpyWritesIt) {
  // crc32 of the bytes of numpy.array([1., 2.]) as .npy, by zlib.
  const std::string npy = compose_npy(std::vector<int64_t>{2}, std::vector<double>{1, 2});
  const std::vector<NamedArray> arrays = parse_weights(zip_of("a.weight.npy", npy, 0xbfaa5b64), "w.npz");
  ASSERT_EQ(arrays.size(), 1U);
  EXPECT_EQ(arrays[0].name, "a.weight");
  EXPECT_EQ(arrays[0].values, (std::vector<double>{1, 2}));
}

TEST(WeightsFile, NpzThatAreNone) {
  const std::string npy = compose_npy(std::vector<int64_t>{2}, std::vector<double>{1, 2}),
                    good = zip_of("a.npy", npy, 0xbfaa5b64);
  EXPECT_NE(message_of("abc", "w.npz").find("does not begin with the bytes of a zip archive"), std::string::npos);
  EXPECT_NE(message_of(good.substr(0, 150), "w.npz").find("its list of arrays is not there"), std::string::npos);
  EXPECT_NE(message_of(zip_of("a.npy", npy, 1), "w.npz").find("a.npy is damaged: its checksum is another one"),
            std::string::npos);
  EXPECT_NE(
      message_of(zip_of("a.npy", npy, 0xbfaa5b64, 8), "w.npz").find("a.npy is compressed; write it with numpy.savez"),
      std::string::npos);
  EXPECT_NE(message_of(zip_of("a.txt", npy, 0xbfaa5b64), "w.npz").find("it holds a.txt, which is no .npy"),
            std::string::npos);
  for (std::size_t at = 0; at < good.size(); ++at) {  // no crash; whatever is read equals what was written
    for (const char flip : {'\x01', '\xff'}) {
      std::string bad = good;
      bad[at] = static_cast<char>(bad[at] ^ flip);
      message([&] {
        for (const NamedArray& array : parse_weights(bad, "w.npz"))
          EXPECT_EQ(array.values, (std::vector<double>{1, 2})) << at;
      });
    }
  }
}

/// A directory of `count` entries that all name the archive's single array.
std::string npz_of_one_array_many_times(const std::string& good, int count) {
  const std::size_t list = good.find("PK\x01\x02"), end = good.find("PK\x05\x06");
  std::string entries;
  for (int i = 0; i < count; ++i) entries += good.substr(list, end - list);
  return good.substr(0, list) + entries + "PK\x05\x06" + little(0, 4) + little(static_cast<uint64_t>(count), 2) +
         little(static_cast<uint64_t>(count), 2) + little(entries.size(), 4) + little(list, 4) + little(0, 2);
}

TEST(WeightsFile, NpzEntriesShareNoBytes) {
  const std::string npy = compose_npy(std::vector<int64_t>{2}, std::vector<double>{1, 2}),
                    good = zip_of("a.npy", npy, 0xbfaa5b64);
  EXPECT_EQ(message_of(npz_of_one_array_many_times(good, 1), "w.npz"), "");
  EXPECT_EQ(message_of(npz_of_one_array_many_times(good, 3), "w.npz"),
            "w.npz is not a usable .npz file: some of its 3 entries share their bytes");
}

/// The sharing is detected before arrays are created: 4000 of 64 KiB would take 256 MiB.
TEST(WeightsFile, SafetensorsThatShareBytesTakeNoMemory) {
  std::string header = "{";
  for (int i = 0; i < 4000; ++i)
    header += (i > 0 ? "," : "") + ("\"n" + std::to_string(i)) +
              R"(":{"dtype":"F64","shape":[8192],"data_offsets":[0,65536]})";
  const std::string bytes = safetensors(header + "}", std::string(65536, '\0'));
  const auto peak = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;  // KiB
  };
  const long before = peak();
  EXPECT_NE(message_of(bytes, "w.safetensors").find("inside the entry before it"), std::string::npos);
  EXPECT_LT(peak() - before, 32 * 1024);
}

TEST(WeightsFile, WrittenAndReadAgain) {
  const TempFolder folder;
  const std::vector<NamedArray> arrays{
      {"n.v1.weight", {2, 1, 3}, {1, 2, 3, 0.1, -5, 1e300}}, {"n.v1.bias", {2}, {0.5, -0.25}}, {"empty", {0, 3}, {}}};
  for (const char* name : {"w.safetensors", "w.npz"}) {
    write_weights(folder.path / name, arrays);
    const std::vector<NamedArray> read = read_weights(folder.path / name);
    ASSERT_EQ(read.size(), arrays.size());
    for (std::size_t i = 0; i < arrays.size(); ++i) {
      EXPECT_EQ(read[i].name, arrays[i].name);
      EXPECT_EQ(read[i].shape, arrays[i].shape);
      EXPECT_EQ(read[i].values, arrays[i].values);
    }
    write_weights(folder.path / name, std::span(arrays).subspan(1, 1), true);
    EXPECT_EQ(read_weights(folder.path / name)[0].values, arrays[1].values);
  }
  EXPECT_NE(message([&] {
              write_weights(folder.path / "w.bin", arrays);
            }).find("ends neither with .safetensors nor with .npz"),
            std::string::npos);
  EXPECT_NE(message([&] {
              write_weights(folder.path / "w.npz", std::vector<NamedArray>{{"a", {3}, {1}}});
            }).find("1 values of a do not have the shape (3)"),
            std::string::npos);
  EXPECT_NE(message([&] { read_weights(folder.path / "none.npz"); }).find("none.npz: No such file"), std::string::npos);
}

/// conv 4, 3 (two groups), relu, conv 1, 1 without bias: in two dimensions.
struct SmallNetwork {
  std::array<dpde_layer, 3> layers{};
  dpde_network network{};
  SmallNetwork() {
    layers[0].kind = DPDE_CONV;
    layers[0].channels = 4;
    layers[0].extent = 3;
    layers[0].groups = 2;
    layers[0].bias = 36;
    layers[1].kind = DPDE_ACTIVATE;
    layers[1].input = 1;
    layers[1].channels = 4;
    layers[2].kind = DPDE_CONV;
    layers[2].input = 2;
    layers[2].channels = 1;
    layers[2].extent = 1;
    layers[2].groups = 1;
    layers[2].weights = 40;
    layers[2].bias = -1;
    network.name = "net";
    network.rank = 2;
    network.inputs = 2;
    network.outputs = 1;
    network.weight_count = 44;
    network.layer_count = 3;
    network.layers = layers.data();
  }
};

TEST(WeightsFile, ArraysOfANetwork) {
  const SmallNetwork small;
  std::vector<double> weights(44);
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = static_cast<double>(i);
  std::vector<NamedArray> arrays = arrays_of(small.network, weights);
  ASSERT_EQ(arrays.size(), 3U);
  EXPECT_EQ(arrays[0].name, "net.v1.weight");
  EXPECT_EQ(arrays[0].shape, (std::vector<int64_t>{4, 1, 3, 3}));
  EXPECT_EQ(arrays[1].name, "net.v1.bias");
  EXPECT_EQ(arrays[1].values, (std::vector<double>{36, 37, 38, 39}));
  EXPECT_EQ(arrays[2].name, "net.v3.weight");
  EXPECT_EQ(arrays[2].shape, (std::vector<int64_t>{1, 4, 1, 1}));
  EXPECT_EQ(weights_of(small.network, arrays, "f"), weights);
  for (NamedArray& array : arrays) array.name = "other" + array.name.substr(3);
  EXPECT_EQ(weights_of(small.network, arrays, "f"), weights) << "the name of the network does not matter";
}

TEST(WeightsFile, ArraysBesideThoseOfTheNetwork) {
  const SmallNetwork small;
  std::vector<double> weights(44);
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = static_cast<double>(i);
  std::vector<NamedArray> arrays = arrays_of(small.network, weights);
  arrays.push_back({"net.count", {}, {}, "I64"});
  EXPECT_EQ(weights_of(small.network, arrays, "f"), weights);
  arrays[1] = {"net.v1.bias", {4}, {}, "I8"};
  EXPECT_NE(message([&] {
              weights_of(small.network, arrays, "f");
            }).find("the numbers of net.v1.bias are of type I8; F64, F32, F16 and BF16 are supported"),
            std::string::npos);
}

/// 10 follows 2, whatever the order in the file.
TEST(WeightsFile, ArraysOfLayersByNumber) {
  const SmallNetwork small;
  std::vector<double> weights(44);
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = static_cast<double>(i);
  std::vector<NamedArray> arrays = arrays_of(small.network, weights);
  arrays[0].name = "2.weight";
  arrays[1].name = "2.bias";
  arrays[2].name = "10.weight";
  std::ranges::reverse(arrays);
  arrays.push_back({"bn.num_batches_tracked", {}, {}, "I64"});
  EXPECT_EQ(weights_of(small.network, arrays, "f"), weights);
  arrays.push_back({"12.weight", {1}, {0}});
  EXPECT_NE(message([&] { weights_of(small.network, arrays, "f"); }).find("they are the weights of another network"),
            std::string::npos);
}

TEST(WeightsFile, ArraysOfAnotherNetwork) {
  const SmallNetwork small;
  const std::vector<NamedArray> good = arrays_of(small.network, std::vector<double>(44, 1.0));
  const auto wrong = [&](const std::function<void(std::vector<NamedArray>&)>& change) {
    std::vector<NamedArray> arrays = good;
    change(arrays);
    return message([&] { weights_of(small.network, arrays, "w.npz"); });
  };
  EXPECT_EQ(wrong([](auto& arrays) { arrays.erase(arrays.begin() + 1); }),
            "w.npz is not a usable file of weights: network net needs an array net.v1.bias; it has net.v1.weight, "
            "net.v3.weight");
  EXPECT_EQ(wrong([](auto& arrays) {
              arrays[2].shape = {1, 2, 1, 2};
            }),
            "w.npz is not a usable file of weights: net.v3.weight has the shape (1, 2, 1, 2), network net needs (1, 4, "
            "1, 1)");
  EXPECT_EQ(wrong([](auto& arrays) { arrays[1].values[2] = NAN; }),
            "w.npz is not a usable file of weights: value 2 of net.v1.bias is nan");
  EXPECT_NE(wrong([](auto& arrays) {
              arrays.push_back({"net.v5.bias", {1}, {0}});
            }).find("they are the weights of another network"),
            std::string::npos);
  EXPECT_NE(wrong([](auto& arrays) { arrays.clear(); }).find("it has none"), std::string::npos);
}

/// Bits of 1, -2, the largest, the smallest subnormal and a third (IEEE 754 binary16; bfloat16 is the upper half of
/// binary32).
TEST(WeightsFile, HalfPrecisionIsRead) {
  const auto read = [](const std::string& type, std::initializer_list<uint16_t> bits) {
    const std::string data = raw<uint16_t>(bits);
    const std::string header = "{\"a\":{\"dtype\":\"" + type + "\",\"shape\":[5],\"data_offsets\":[0,10]}}";
    return parse_weights(safetensors(header, data), "w.safetensors")[0].values;
  };
  EXPECT_EQ(read("F16", {0x3c00, 0xc000, 0x7bff, 0x0001, 0x3555}),
            (std::vector<double>{1, -2, 65504, std::ldexp(1, -24), std::ldexp(1365, -12)}));
  EXPECT_EQ(read("BF16", {0x3f80, 0xc000, 0x7f7f, 0x0001, 0x3eab}),
            (std::vector<double>{1, -2, std::ldexp(255, 120), std::ldexp(1, -133), std::ldexp(171, -9)}));
}

}  // namespace
}  // namespace dpde
