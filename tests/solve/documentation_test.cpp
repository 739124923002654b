#include <flyball/solve/documentation.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "answers.hpp"

// The table of kinds: its examples, its documentation and its schema.
namespace flyball::solve::documentation_test {
namespace {

std::string file(const std::string& path) {
  std::ifstream stream(std::string(FLYBALL_PROJECT_DATA) + "/../../docs/" + path);
  EXPECT_TRUE(stream) << path;
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// The sizes that the letters of one answer stand for, as the test finds them.
class Letters {
 public:
  /// Whether a size of the row ("n", "n+p", "2") may be `actual`. A sum is checked where its
  /// letters are known, and else is one size of its own.
  bool fits(const std::string& size, std::size_t actual) {
    std::size_t sum = 0;
    for (std::size_t k = 0; k < size.size(); k += 2) {
      const auto found = known_.find(size.substr(k, 1));
      if (found == known_.end() && std::isdigit(size[k]) == 0) {
        return known_.emplace(size, actual).first->second == actual;
      }
      sum += found == known_.end() ? static_cast<std::size_t>(size[k] - '0') : found->second;
    }
    return sum == actual;
  }

 private:
  std::map<std::string, std::size_t> known_;
};

bool is_number(const Json& value) {
  return value.is_number() || value.is_null() || value == "inf" || value == "-inf";
}

bool is_complex(const Json& value) {
  return value.is_array() && value.size() == 2 && is_number(value[0]) && is_number(value[1]);
}

bool is_matrix(const Json& value, const Field& field, Letters& letters) {
  if (!value.is_array() || !letters.fits(std::string(field.rows), value.size())) {
    return false;
  }
  return std::all_of(value.begin(), value.end(), [&](const Json& row) {
    return row.is_array() && letters.fits(std::string(field.columns), row.size()) &&
           std::all_of(row.begin(), row.end(), is_number);
  });
}

/// Whether a value is of its row's type and shape.
bool is_as_told(const Json& value, const Field& field, Letters& letters) {
  switch (field.type) {
    case FieldType::number:
      return is_number(value);
    case FieldType::integer:
      return value.is_number() && value.get<double>() == std::floor(value.get<double>());
    case FieldType::flag:
      return value.is_boolean();
    case FieldType::text:
      return value.is_string();
    case FieldType::matrix:
      return is_matrix(value, field, letters);
    case FieldType::record:
      return value.is_object();
    case FieldType::records:
      return value.is_array() && std::all_of(value.begin(), value.end(), [](const Json& one) {
               return one.is_object() && !one.empty();
             });
    case FieldType::list:
      return value.is_array() && letters.fits(std::string(field.rows), value.size()) &&
             std::all_of(value.begin(), value.end(), is_number);
    case FieldType::complex_list:
      return value.is_array() && letters.fits(std::string(field.rows), value.size()) &&
             std::all_of(value.begin(), value.end(), is_complex);
    case FieldType::transfer:
      return value.is_object() && value.at("num").is_array() && value.at("den").is_array();
    case FieldType::texts:
      return value.is_array() && std::all_of(value.begin(), value.end(),
                                             [](const Json& one) { return one.is_string(); });
    case FieldType::matrices:
      return value.is_array() && std::all_of(value.begin(), value.end(), [&](const Json& M) {
               return is_matrix(M, field, letters);
             });
    default:
      return false;
  }
}

/// What of a JSON Schema the command's own one uses; empty if the value is as it says.
std::string complaint(const Json& value, const Json& schema, const Json& root) {
  if (schema.is_boolean()) {
    return schema.get<bool>() ? "" : "not allowed";
  }
  if (const auto reference = schema.find("$ref"); reference != schema.end()) {
    const std::string name = reference->get<std::string>().substr(std::string("#/$defs/").size());
    return complaint(value, root.at("$defs").at(name), root);
  }
  if (const auto any = schema.find("anyOf"); any != schema.end()) {
    return std::any_of(any->begin(), any->end(),
                       [&](const Json& one) { return complaint(value, one, root).empty(); })
               ? ""
               : value.dump() + " is none of " + any->dump();
  }
  if (const auto choices = schema.find("enum"); choices != schema.end()) {
    return std::find(choices->begin(), choices->end(), value) != choices->end()
               ? ""
               : value.dump() + " is none of " + choices->dump();
  }
  const std::string type = schema.value("type", "");
  const bool right = type == "object"    ? value.is_object()
                     : type == "array"   ? value.is_array()
                     : type == "number"  ? value.is_number()
                     : type == "integer" ? value.is_number_integer()
                     : type == "boolean" ? value.is_boolean()
                     : type == "string"  ? value.is_string()
                                         : false;
  if (!right) {
    return value.dump() + " is not " + type;
  }
  if (value.is_array()) {
    if (value.size() < schema.value("minItems", std::size_t{0}) ||
        value.size() > schema.value("maxItems", value.size())) {
      return value.dump() + " has the wrong length";
    }
    for (const Json& entry : value) {
      if (std::string found = complaint(entry, schema.at("items"), root); !found.empty()) {
        return found;
      }
    }
  }
  if (value.is_object()) {
    for (const Json& name : schema.value("required", Json::array())) {
      if (!value.contains(name.get<std::string>())) {
        return name.get<std::string>() + " is missing";
      }
    }
    for (const auto& [name, entry] : value.items()) {
      const auto property = schema.at("properties").find(name);
      if (property == schema.at("properties").end()) {
        if (schema.contains("additionalProperties")) {
          return name + " is not a property";
        }
        continue;
      }
      if (std::string found = complaint(entry, *property, root); !found.empty()) {
        return name + ": " + found;
      }
    }
  }
  return "";
}

// Each row's example has an answer with the fields, types and shapes that the row tells.
TEST(SolveTable, ExamplesAreAnsweredAsTold) {
  EXPECT_GE(kinds().size(), 36U);
  for (const Kind& kind : kinds()) {
    const Json json = answer(kind.name, std::string(kind.example));
    ASSERT_FALSE(json.contains("error")) << kind.name << ": " << json;
    Letters letters;
    std::set<std::string_view> told;
    for (const Field& field : kind.answer) {
      EXPECT_TRUE(told.insert(field.name).second) << kind.name << "." << field.name;
      if (!json.contains(field.name)) {
        EXPECT_NE(field.absent, Absent::refused) << kind.name << "." << field.name;
      } else {
        EXPECT_TRUE(is_as_told(json.at(std::string(field.name)), field, letters))
            << kind.name << "." << field.name << " is " << json.at(std::string(field.name));
      }
    }
    for (const auto& [name, value] : json.items()) {
      EXPECT_TRUE(told.contains(name)) << kind.name << " answers " << name;
    }
  }
}

// A field that is left out, null, unknown or of another type is refused by its row, in every kind.
TEST(SolveTable, EveryFieldIsChecked) {
  for (const Kind& kind : kinds()) {
    const Json example = Json::parse(kind.example);
    Json unknown = example;
    unknown["Zeta"] = 1;
    EXPECT_EQ(refusal(kind.name, unknown.dump()), "unknown_name") << kind.name;
    for (const Field& field : kind.fields) {
      const std::string name(field.name);
      Json changed = example;
      for (const Json& value : {Json(nullptr), Json(true), Json("five"), Json::object()}) {
        changed[name] = value;
        const std::string code = refusal(kind.name, changed.dump());
        if (value.is_null()) {
          EXPECT_TRUE(field.absent != Absent::refused || code == "malformed") << kind.name << name;
        } else if (field.type == FieldType::choice && value.is_string()) {
          EXPECT_EQ(code, "unknown_name") << kind.name << "." << name;
        } else if (field.type == FieldType::transfer && value.is_string()) {
          EXPECT_EQ(code, "unknown_name") << kind.name << "." << name;  // "five" in an expression
        } else {
          EXPECT_EQ(code, "malformed") << kind.name << "." << name << " = " << value;
        }
      }
      changed[name] = Json::array();
      if (field.type == FieldType::matrix || field.type == FieldType::list) {
        EXPECT_EQ(refusal(kind.name, changed.dump()), "empty") << kind.name << "." << name;
      }
      changed[name] = "nan";
      if (field.type == FieldType::matrix || field.type == FieldType::number) {
        // A number is a 1 x 1 matrix, which may be the wrong shape.
        const std::string code = refusal(kind.name, changed.dump());
        EXPECT_TRUE(code == "not_finite" ||
                    (field.type == FieldType::matrix && code == "wrong_shape"))
            << kind.name << "." << name << " " << code;
      }
    }
  }
}

TEST(SolveTable, UnknownFieldsAndChoicesNameTheNearest) {
  const Json field = answer("kalman", R"({"A":[[1]],"C":[[1]],"Q":[[1]],"r":[[1]]})");
  EXPECT_EQ(field.at("error").at("message"),
            "kalman: field is \"r\"; it must be one of A, C, Q, R; did you mean \"R\"?");
  const Json choice = answer("c2d", R"({"A":[[0]],"B":[[1]],"T":1,"method":"tustn"})");
  EXPECT_EQ(choice.at("error").at("message"),
            "c2d: method is \"tustn\"; it must be \"zoh\", \"foh\", \"tustin\", \"forward-euler\", "
            "\"backward-euler\" or \"matched\"; did you mean \"tustin\"?");
  const Json shape = answer("dare", R"({"A":[[1]],"B":[[1],[2]],"Q":[[1]],"R":[[1]]})");
  EXPECT_EQ(shape.at("error").at("message"), "dare: B is 2x1; it must be states x inputs (1x1)");
}

// docs/ is what the table says; `scripts/write-docs` writes it.
TEST(SolveTable, DocumentationIsUpToDate) {
  EXPECT_EQ(file("solve.md"), markdown());
  EXPECT_EQ(file("schemas/solve.schema.json"), json_schema());
}

TEST(SolveTable, HelpNamesEveryField) {
  for (const Kind& kind : kinds()) {
    const std::string help = help_of(kind);
    for (const Field& field : kind.fields) {
      EXPECT_NE(help.find(field.help), std::string::npos) << kind.name << "." << field.name;
      EXPECT_FALSE(field.help.empty()) << kind.name << "." << field.name;
    }
    for (const Field& field : kind.answer) {
      EXPECT_FALSE(field.help.empty()) << kind.name << "." << field.name;
    }
    for (const std::vector<Field>& fields : {kind.fields, kind.answer}) {
      for (const Field& field : fields) {
        const std::string sizes = std::string(field.rows) + std::string(field.columns);
        for (const char c : sizes) {
          if (c >= 'a' && c <= 'z') {
            EXPECT_NE(help.find(std::string("\n  ") + c + "  "), std::string::npos)
                << kind.name << "." << field.name << ": what is " << c << "?";
          }
        }
      }
    }
    EXPECT_NE(help.find(kind.example), std::string::npos) << kind.name;
    EXPECT_NE(list_of_kinds().find(kind.help), std::string::npos) << kind.name;
  }
}

TEST(SolveTable, SchemaFitsProblemsAnswersAndRefusals) {
  const Json schema = Json::parse(json_schema());
  const auto fits = [&](const Json& value, const std::string& name) {
    return complaint(value, schema.at("$defs").at(name), schema);
  };
  for (const Kind& kind : kinds()) {
    const std::string name(kind.name);
    EXPECT_EQ(fits(Json::parse(kind.example), name + ".problem"), "") << name;
    EXPECT_EQ(fits(answer(kind.name, std::string(kind.example)), name + ".answer"), "") << name;
    EXPECT_EQ(fits(answer(kind.name, "{}"), "refusal"), "") << name;
    EXPECT_NE(fits(answer(kind.name, "{}"), name + ".answer"), "") << name;
    EXPECT_NE(fits(Json{{"Zeta", 1}}, name + ".problem"), "") << name;
  }
}

}  // namespace
}  // namespace flyball::solve::documentation_test
