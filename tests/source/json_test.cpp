// SPDX-License-Identifier: Apache-2.0
#include "support/json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace dpde {
namespace {

TEST(Json, IsWrittenInTheOrderOfItsKeys) {
  Json json = {{"z", 1}, {"a", {1.5, true, nullptr, "t"}}};
  json["m"]["k"] = std::vector<int>{};
  EXPECT_EQ(json.dump(), R"({"z":1,"a":[1.5,true,null,"t"],"m":{"k":[]}})");
  EXPECT_EQ(Json({1, 2}).dump(), "[1,2]");
  EXPECT_EQ(Json::array({Json::object()}).dump(1), "[\n {}\n]");
  EXPECT_EQ(Json("\xff").dump(), "\"\xEF\xBF\xBD\"");
}

TEST(Json, IsReadAsItWasWritten) {
  const std::string text = R"({"b":[{"x":-3,"y":0.1},[]],"a":null,"t":"é\n","big":9.3e+18})";
  const std::optional<Json> json = parse_json(text);
  ASSERT_TRUE(json);
  EXPECT_EQ(json->dump(), text);
  EXPECT_EQ((*json)["b"][0]["y"].get<double>(), 0.1);
  EXPECT_EQ(parse_json("18446744073709551615")->get<std::uint64_t>(), std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(Json(std::numeric_limits<std::uint64_t>::max()).dump(), "18446744073709551615");
  EXPECT_FALSE(parse_json(std::string(100000, '[') + std::string(100000, ']'))) << "and no stack overflows";
  EXPECT_FALSE(parse_json("{\"a\":"));
  EXPECT_FALSE(parse_json(""));
}

TEST(Json, ComparesValuesAndNotTheirKinds) {
  EXPECT_EQ(Json(2), 2.0);
  EXPECT_LT(Json(2), 2.5);
  EXPECT_GT(Json("b"), Json("a"));
  EXPECT_NE(Json("2"), Json(2));
  EXPECT_NE(Json(false), Json(nullptr));
  EXPECT_NE(Json(NAN), Json(NAN));
  EXPECT_EQ(Json({{"a", 1}, {"b", 2}}), Json({{"b", 2}, {"a", 1}}));
  EXPECT_NE(Json({{"a", 1}}), Json({{"b", 1}}));
  EXPECT_EQ(Json({1, 2}), Json({1.0, 2}));
  EXPECT_FALSE(Json({1}) < Json({2}));
}

TEST(Json, WhatIsTakenOutOfAValueThatGoesAwayStays) {
  const auto made = [] { return Json({{"a", {std::string(100, 'x'), std::string(100, 'y')}}}); };
  std::string all;
  for (const Json& text : made()["a"]) all += text.get<std::string>();
  EXPECT_EQ(all, std::string(100, 'x') + std::string(100, 'y'));
}

TEST(Json, PartsMayBeCopiedWithinIt) {
  Json json = Json::object();
  json["m"] = json["k"] = std::string(100, 'x');
  for (const std::string key : {"a", "b", "c", "d", "e", "f", "g", "h"}) json[key] = json["k"];
  for (const auto& [key, value] : json.items()) EXPECT_EQ(value, std::string(100, 'x')) << key;
  EXPECT_EQ(json.size(), 10u);
}

TEST(Json, SaysWhatIsNotThere) {
  const Json json = {{"a", {1}}};
  EXPECT_THROW(json["b"], JsonError);
  EXPECT_THROW(json["a"][1], JsonError);
  EXPECT_THROW(json["a"]["b"], JsonError);
  EXPECT_THROW(json["a"].get<double>(), JsonError);
  EXPECT_THROW(json["a"][0].get<std::string>(), JsonError);
  EXPECT_THROW(json["a"][0].get<bool>(), JsonError);
  EXPECT_THROW(Json(1e300).get<int>(), JsonError);
  EXPECT_THROW(Json(-1).get<std::uint64_t>(), JsonError);
  EXPECT_EQ(json.value("b", 3), 3);
  EXPECT_EQ(json["a"].get<std::vector<int>>(), std::vector<int>{1});
}

}  // namespace
}  // namespace dpde
