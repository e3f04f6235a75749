// SPDX-License-Identifier: Apache-2.0
// .npy files: bytes as NumPy writes them, and invalid ones.
#include "dpde/runtime/npy.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "dpde/runtime/error.h"

namespace dpde {
namespace {

std::string file_of(const std::string& dictionary, const std::string& data, int version = 1) {
  std::string header = "\x93NUMPY";
  header += {static_cast<char>(version), '\0', static_cast<char>(dictionary.size() & 0xff),
             static_cast<char>(dictionary.size() >> 8)};
  if (version > 1) header += {'\0', '\0'};
  return header + dictionary + data;
}

template <class Number>
std::string bytes_of(const std::vector<Number>& values, bool big_endian = false) {
  std::string bytes;
  for (Number value : values) {
    auto raw = std::bit_cast<std::array<char, sizeof(Number)>>(value);
    bytes += big_endian ? std::string(raw.rbegin(), raw.rend()) : std::string(raw.begin(), raw.end());
  }
  return bytes;
}

NpyArray parse(const std::string& bytes) { return parse_npy(bytes, "a.npy"); }

std::string message(const std::string& bytes) {
  try {
    parse(bytes);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    return error.what();
  }
  return "";
}

TEST(Npy, TypesAndByteOrders) {
  const std::vector<double> expected{1, -2, 3, 4, 5, 6};
  const std::string shape = ", 'fortran_order': False, 'shape': (2, 3), }\n";
  for (const std::string& bytes : {file_of("{'descr': '<f8'" + shape, bytes_of<double>({1, -2, 3, 4, 5, 6})),
                                   file_of("{'descr': '>f8'" + shape, bytes_of<double>({1, -2, 3, 4, 5, 6}, true)),
                                   file_of("{'descr': '<f4'" + shape, bytes_of<float>({1, -2, 3, 4, 5, 6})),
                                   file_of("{'descr': '<i8'" + shape, bytes_of<int64_t>({1, -2, 3, 4, 5, 6})),
                                   file_of("{'descr': '<i4'" + shape, bytes_of<int32_t>({1, -2, 3, 4, 5, 6})),
                                   file_of("{'descr': '>i4'" + shape, bytes_of<int32_t>({1, -2, 3, 4, 5, 6}, true)),
                                   file_of("{'descr': '<f8'" + shape, bytes_of<double>({1, -2, 3, 4, 5, 6}), 2),
                                   file_of("{'descr': '<f8'" + shape, bytes_of<double>({1, -2, 3, 4, 5, 6}), 3)}) {
    const NpyArray array = parse(bytes);
    EXPECT_EQ(array.shape, (std::vector<int64_t>{2, 3}));
    EXPECT_EQ(array.values, expected);
  }
}

TEST(Npy, TruthValuesAndIntegersOfAllSizes) {
  const auto values_of = [](const std::string& type, const std::string& data) {
    return parse(file_of("{'descr': '" + type + "', 'fortran_order': False, 'shape': (3,), }", data)).values;
  };
  EXPECT_EQ(values_of("|b1", bytes_of<uint8_t>({1, 0, 1})), (std::vector<double>{1, 0, 1}));
  EXPECT_EQ(values_of("|u1", bytes_of<uint8_t>({0, 7, 255})), (std::vector<double>{0, 7, 255}));
  EXPECT_EQ(values_of("|i1", bytes_of<int8_t>({0, -7, -128})), (std::vector<double>{0, -7, -128}));
  EXPECT_EQ(values_of("<i2", bytes_of<int16_t>({1, -2, 300})), (std::vector<double>{1, -2, 300}));
  EXPECT_EQ(values_of(">u2", bytes_of<uint16_t>({1, 2, 65535}, true)), (std::vector<double>{1, 2, 65535}));
  EXPECT_EQ(values_of("<u4", bytes_of<uint32_t>({1, 2, 4294967295U})), (std::vector<double>{1, 2, 4294967295.0}));
  EXPECT_EQ(values_of("<u8", bytes_of<uint64_t>({1, 2, 1ULL << 63})),
            (std::vector<double>{1, 2, 9223372036854775808.0}));
}

TEST(Npy, FortranOrderIsTurnedIntoCOrder) {
  // element (i, j, k) of a 2 x 3 x 2 array is 100 i + 10 j + k
  std::vector<double> fortran, c;
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 2; ++i) fortran.push_back(100 * i + 10 * j + k);
    }
  }
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 2; ++k) c.push_back(100 * i + 10 * j + k);
    }
  }
  EXPECT_EQ(parse(file_of("{'shape': (2, 3, 2), 'fortran_order': True, 'descr': '<f8'}", bytes_of(fortran))).values, c);
}

TEST(Npy, ShapesOfAllRanks) {
  const std::string rest = "), 'fortran_order': False, 'descr': '<f8'}";
  EXPECT_EQ(parse(file_of("{'shape': (" + rest, bytes_of<double>({7}))).values, std::vector<double>{7});
  EXPECT_TRUE(parse(file_of("{'shape': (" + rest, bytes_of<double>({7}))).shape.empty());
  EXPECT_EQ(parse(file_of("{'shape': (2," + rest, bytes_of<double>({7, 8}))).shape, std::vector<int64_t>{2});
  EXPECT_TRUE(parse(file_of("{'shape': (0, 4" + rest, "")).values.empty());
}

TEST(Npy, SaysWhatIsWrong) {
  const auto with = [](const std::string& type, const std::string& shape) {
    return file_of("{'descr': '" + type + "', 'fortran_order': False, 'shape': " + shape + "}", std::string(16, '\0'));
  };
  const std::string start = "a.npy is not a usable .npy file: ";
  EXPECT_EQ(message("hello"), start + "it does not begin with the bytes of one");
  EXPECT_EQ(message(""), start + "it does not begin with the bytes of one");
  EXPECT_EQ(message("\x93NUMPY"), start + "it ends inside its header");
  EXPECT_EQ(message(file_of("{", "")),
            start + "its header has no text in quotes where one belongs (records are not supported)");
  EXPECT_EQ(message(with("<c16", "(1,)")),
            start + "its numbers are of type '<c16'; float64, float32, integers and truth values are supported");
  EXPECT_EQ(message(with("<f8", "(3,)")), start + "16 bytes of numbers are too few for its shape (3)");
  EXPECT_EQ(message(with("<f8", "(1,)")), start + "8 bytes follow the numbers of its shape (1)");
  EXPECT_EQ(message(with("<f8", "(4294967296, 4294967296, 2)")),
            start + "16 bytes of numbers are too few for its shape (4294967296, 4294967296, 2)");
  EXPECT_EQ(message(with("<f8", "(-2,)")), start + "its shape is not a list of sizes");
  EXPECT_EQ(message(with("<f8", "(99999999999999999999,)")), start + "its shape is not a list of sizes");
  EXPECT_EQ(message(file_of("{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (2,)}", "")),
            start + "its header has no text in quotes where one belongs (records are not supported)");
  EXPECT_EQ(message(file_of("{'descr': '<f8', 'shape': (2,)}", "")),
            start + "its header lacks descr, fortran_order or shape");
  std::string oversized = file_of("{}", "");
  oversized[8] = oversized[9] = '\xff';
  EXPECT_EQ(message(oversized), start + "it ends inside its header");
  std::string version = file_of("{}", "");
  version[6] = 9;
  EXPECT_EQ(message(version), start + "its format version 9 is not 1, 2 or 3");
}

TEST(Npy, FilesThatCannotBeRead) {
  for (const char* path : {"/nowhere/a.npy", "/tmp"}) {
    try {
      read_npy(path);
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      EXPECT_EQ(std::string(error.what()).find("cannot read " + std::string(path)), 0u) << error.what();
    }
  }
}

TEST(Npy, WhatIsWrittenIsReadBack) {
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "dpde_npy_test.npy";
  for (const std::vector<int64_t>& shape : std::vector<std::vector<int64_t>>{{}, {6}, {2, 3}, {1, 2, 3}, {0}}) {
    size_t count = 1;
    for (int64_t n : shape) count *= static_cast<size_t>(n);
    std::vector<double> values(count, 0.1);
    if (count > 3) values[3] = -std::numeric_limits<double>::infinity();
    write_npy(path, shape, values);
    EXPECT_EQ(std::filesystem::file_size(path) % 64, count * 8 % 64);  // the numbers begin on a 64-byte boundary
    const NpyArray array = read_npy(path);
    EXPECT_EQ(array.shape, shape);
    EXPECT_EQ(array.values, values);
  }
  EXPECT_THROW(write_npy(path, std::vector<int64_t>{3}, std::vector<double>(2)), Error);
  EXPECT_EQ(read_npy(path).shape, std::vector<int64_t>{0});
  std::filesystem::remove(path);
}

TEST(Npy, PartsAreWhatAllIsAtOnce) {
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "dpde_npy_parts_test.npy";
  write_npy(path, std::vector<int64_t>{3, 2}, 3, [](int64_t k) { return std::vector<double>{double(k), 0.5}; });
  EXPECT_EQ(read_npy(path).values, (std::vector<double>{0, 0.5, 1, 0.5, 2, 0.5}));
  EXPECT_THROW(write_npy(path, std::vector<int64_t>{3, 2}, 3, [](int64_t) { return std::vector<double>(1); }), Error);
  EXPECT_EQ(read_npy(path).shape, (std::vector<int64_t>{3, 2})) << "what was there is untouched";
  std::filesystem::remove(path);
}

TEST(Npy, DamagedFilesAreReadOrRefusedNeverMore) {
  const std::string good = file_of("{'descr': '<f8', 'fortran_order': True, 'shape': (2, 3), }     \n",
                                   bytes_of<double>({1, 2, 3, 4, 5, 6}));
  ASSERT_EQ(parse(good).values.size(), 6u);
  std::mt19937 random(42);
  int refused = 0;
  for (int round = 0; round < 4000; ++round) {
    std::string bytes = good;
    const int kind = round % 4;
    for (unsigned i = 0; i < 1 + random() % 3; ++i) {
      const size_t place = random() % (kind == 3 ? 80 : bytes.size());
      if (kind == 0) bytes[place % bytes.size()] = static_cast<char>(random());
      if (kind == 1) bytes.resize(place % bytes.size());
      if (kind == 2) bytes.insert(place, 1, "(){}',:0123456789-<>f"[random() % 21]);
      if (kind == 3) bytes[place] = "(){}',:0123456789-<>f"[random() % 21];
      if (bytes.empty()) break;
    }
    try {
      const NpyArray array = parse(bytes);
      size_t count = 1;
      for (int64_t n : array.shape) count *= static_cast<size_t>(n);
      EXPECT_EQ(array.values.size(), count);
      EXPECT_LE(array.values.size() * 4, bytes.size());
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 2000);
  EXPECT_LT(refused, 4000);
}

}  // namespace
}  // namespace dpde
