// The table of fields: whatever it says can be written, read, typed and looked up.
#include <cmath>
#include <set>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <flyball/io/file.hpp>
#include <flyball/study/project.hpp>

#include "study/field.hpp"
#include "study/mechanism_parts.hpp"
#include "study/read_value.hpp"

namespace flyball::study::fields_test {
namespace {

double any_number() {
  const auto mantissa = *rc::gen::inRange<long long>(1LL << 52, 1LL << 53);
  return std::ldexp(static_cast<double>(mantissa), *rc::gen::inRange(-60, -45));
}

double number_in(Range range) {
  if (range == Range::not_negative && *rc::gen::inRange(0, 4) == 0) {
    return 0.0;
  }
  return range == Range::any && *rc::gen::arbitrary<bool>() ? -any_number() : any_number();
}

std::string any_text() {
  return *rc::gen::nonEmpty(rc::gen::container<std::string>(
      rc::gen::oneOf(rc::gen::inRange<char>(1, 127), rc::gen::elementOf(std::string("\"\\\n")))));
}

FieldValue any_value(const Field& field, std::size_t states) {
  switch (field.type) {
    case FieldType::quantity:
      return number_in(field.range);
    case FieldType::list: {
      std::vector<double> values(states);
      for (double& value : values) {
        value = number_in(field.range);
      }
      return values;
    }
    case FieldType::text:
      return field.key == "motor"           ? std::string("Kraken X60 FOC")
             : field.key == "unit"          ? std::string("rotations")
             : field.key == "velocity_unit" ? std::string("RPM")
                                            : any_text();
    case FieldType::whole:
      return *rc::gen::inRange<long long>(field.least, 1LL << 62);
    case FieldType::flag:
      return *rc::gen::arbitrary<bool>();
    case FieldType::names:
    case FieldType::map:
      return {};  // of a model by formula, which is tested by itself
  }
  return {};
}

/// Whether a key means something for a kind of mechanism.
bool is_of(const MechanismRow& row, const Section& section, const Field& field) {
  const auto needs = [&](const MechanismRow& one) {
    return std::find(one.needs.begin(), one.needs.end(), field.key) != one.needs.end();
  };
  if (field.key == "stages" || field.key == "counterbalance") {
    return row.kind == mechanisms::MechanismKind::elevator;
  }
  if (section.name == "mechanism") {
    return needs(row) || std::none_of(mechanism_rows().begin(), mechanism_rows().end(), needs);
  }
  return field.subject != Subject::model && (field.key != "kG" || has_gravity(row.kind)) &&
         (field.key != "angle_offset" || row.kind == mechanisms::MechanismKind::arm);
}

/// Any values in any fields, as far as they make a mechanism.
Project any_project(mechanisms::MechanismKind kind) {
  Project project;
  const MechanismRow& row = mechanism_row(kind);
  const std::size_t states = row.signals.states.size();
  const bool custom = *rc::gen::arbitrary<bool>();
  for (const Section& section : project_document().sections) {
    if (section.subject == Subject::model || section.subject == Subject::drive ||
        (section.name == "mechanism.motor" && !custom)) {
      continue;
    }
    void* object = section.within(&project, true);
    for (const Field& field : section.fields) {
      const bool is_kind = !field.choices.empty();
      const bool motor_name = field.key == "motor" && custom;
      if (!motor_name && !is_kind && (field.required || *rc::gen::arbitrary<bool>()) &&
          field.type != FieldType::map && field.type != FieldType::names &&
          is_of(row, section, field)) {
        field.access.set(object, any_value(field, states));
      }
    }
  }
  project.parts.type = kind;
  if (custom || !project.parts.motor.empty()) {
    project.parts.motor_count = *rc::gen::inRange(1, 5);
  } else {
    project.parts.motor_count.reset();
  }
  if (project.parts.mass == Mass(0.0)) {
    project.parts.mass.reset();  // of an arm alone
  }
  // What means something beside others only.
  if (!project.gains.kV || project.gains.kA) {
    project.gains.kA_upper_bound.reset();
  }
  study::SizeSection& size = project.size;
  size.distance.reset();
  size.stop.reset();
  size.grip.reset();
  size.efficiency = std::min(size.efficiency, 1.0);
  if (size.winding_heat_capacity) {
    size.winding_heat_capacity = *rc::gen::inRange(20, 200);  // J/K that copper has
    size.locked_rotor.clear();
  } else if (size.locked_rotor.empty()) {
    size.winding_thermal_resistance.reset();
  }
  if (custom) {
    project.parts.custom_motor->free_current =
        Current(0.1 * project.parts.custom_motor->stall_current.si());
  }
  return project;
}

TEST(Fields, WhatIsWrittenReadsBackAsItWas) {
  for (const MechanismRow& row : mechanism_rows()) {
    {
      const bool holds = rc::check([&] {
        const Project project = any_project(row.kind);
        const std::string text = write_project(project, "A heading\nof two lines");
        const auto read = parse_project(text, "p.toml");
        ASSERT_TRUE(read) << to_string(read.error()) << "\n" << text;
        for (const Section& section : project_document().sections) {
          const void* before = find(section, &project);
          const void* after = find(section, &*read);
          ASSERT_EQ(before == nullptr, after == nullptr) << section.name;
          for (const Field& field : before == nullptr ? std::span<const Field>() : section.fields) {
            EXPECT_TRUE(field.access.get(before) == field.access.get(after))
                << name_of(section.name, field.key) << "\n"
                << text;
          }
        }
        EXPECT_EQ(write_project(*read, "A heading\nof two lines"), text);
      });
      EXPECT_TRUE(holds);
    }
  }
}

TEST(Fields, AModelIsWrittenAsItWas) {
  Project project;
  project.model.states = {{"θ", "rad"}, {"omega", "rad/s"}};
  project.model.derivative = {{"omega", "-sin(θ)/s^2"}, {"θ", "omega"}};
  project.model.parameters = {{"s", "1 s"}};
  project.model.angles = {"θ"};
  project.point.at = {{"θ", "10 deg"}};
  const std::string_view sections[] = {"model", "point"};
  const std::string text = write_project(project, {}, sections);
  const auto read = parse_project(text, "p.toml");
  ASSERT_TRUE(read) << to_string(read.error()) << "\n" << text;
  EXPECT_EQ(read->model.states, project.model.states);
  EXPECT_EQ(read->model.derivative, project.model.derivative);
  EXPECT_EQ(read->model.angles, project.model.angles);
  EXPECT_EQ(read->point.at, project.point.at);
  EXPECT_EQ(write_project(*read, {}, sections), text);
}

TEST(Fields, CommentsStandBesideTheirKeys) {
  Project project;
  project.parts.type = mechanisms::MechanismKind::elevator;
  project.gains.kV = 4.0;
  const std::string_view sections[] = {"mechanism", "gains"};
  const std::vector<KeyComment> comments{{"gains.kV", "V·s/m"}, {"gains.kA", "is not determined"}};
  EXPECT_EQ(write_project(project, "Two\nlines", sections, comments),
            "# Two\n# lines\n\n[mechanism]\ntype = \"elevator\"\n\n[gains]\n"
            "kV = 4.0  # V·s/m\n# kA is not determined\n");
}

TEST(Fields, ADesignAsAProjectIsTheSameJob) {
  for (const char* motor :
       {"motor = \"NEO\"\nmotor_count = 2\n",
        "[mechanism.motor]\nnominal_voltage = \"24 V\"\nstall_torque = \"2.5 N m\"\n"
        "stall_current = \"100 A\"\nfree_current = \"2 A\"\nfree_speed = \"600 rad/s\"\n"}) {
    const std::string text = std::string(
                                 "[mechanism]\ntype = \"elevator\"\ngearing = 10.0\n"
                                 "mass = \"8 kg\"\ndrum_radius = \"1 in\"\n") +
                             motor + "[controller]\ndelay = \"7 ms\"\n";
    const auto job = parse_project(text, "p.toml");
    ASSERT_TRUE(job) << to_string(job.error());
    const auto result = design(job->job);
    ASSERT_TRUE(result) << to_string(result.error());
    const std::string written = gains_toml(*result, nullptr);
    for (const char* other : {"angle_offset", "[log]", "mass"}) {
      EXPECT_EQ(written.find(other), std::string::npos) << written;
    }
    const auto again = parse_project(written, "gains.toml");
    ASSERT_TRUE(again) << to_string(again.error());
    const PlantDescription& before = result->job.plant;
    const PlantDescription& after = again->job.plant;
    EXPECT_EQ(after.gains.kV, before.gains.kV);
    EXPECT_EQ(after.gains.kA, before.gains.kA);
    EXPECT_EQ(after.gains.kG, before.gains.kG);
    EXPECT_EQ(after.motor->R, before.motor->R);
    EXPECT_EQ(after.motor->count, before.motor->count);
    EXPECT_EQ(after.nominal_voltage, before.nominal_voltage);
    EXPECT_EQ(after.gearing, before.gearing);
    EXPECT_EQ(after.drum_radius, before.drum_radius);
    EXPECT_EQ(again->job.controller.delay, result->job.controller.delay);
    EXPECT_EQ(again->job.controller.state_tolerance, result->job.controller.state_tolerance);
    EXPECT_EQ(again->job.estimator.measurement_std, result->job.estimator.measurement_std);
    // And its design is the same, battery and all.
    EXPECT_EQ(design(again->job)->response.columns().back().values,
              result->response.columns().back().values);
  }
}

TEST(Fields, EveryExampleIsWhatTheFieldTakes) {
  for (const Section& section : project_document().sections) {
    EXPECT_FALSE(section.summary.empty()) << section.name;
    for (const Field& field : section.fields) {
      const std::string name = name_of(section.name, field.key);
      EXPECT_FALSE(field.help.empty() || field.example.empty()) << name;
      const auto keys = toml::parse(std::string(field.key) + " = " + std::string(field.example));
      if (field.type == FieldType::map) {
        EXPECT_TRUE(keys.get(field.key)->is_table()) << name;  // read as texts, not as a value
        continue;
      }
      // The examples are an elevator's.
      const auto dimensions =
          dimensions_of(field, mechanism_row(mechanisms::MechanismKind::elevator).signals);
      const auto value = read_value(field, *keys.get(field.key), dimensions, name);
      EXPECT_TRUE(value) << (value ? "" : to_string(value.error()));
    }
  }
}

TEST(Fields, EveryOptionOfAJobIsItsOwnAndSaysWhatItTakes) {
  for (const JobKind job :
       {JobKind::identify, JobKind::design, JobKind::tune, JobKind::analyze, JobKind::simulate}) {
    std::set<std::string> options;
    for (const FieldInfo& field : fields_of(job)) {
      EXPECT_TRUE(options.insert(field.option).second) << field.option;
      EXPECT_TRUE(field.option.starts_with("--") && !field.help.empty());
      // Only a flag takes nothing.
      EXPECT_EQ(field.value.empty(), field.example == "true") << field.option;
      EXPECT_EQ(field.option.find('_'), std::string::npos);
    }
    EXPECT_FALSE(options.empty());
  }
  const auto design = fields_of(JobKind::design);
  const auto period = std::find_if(design.begin(), design.end(), [](const FieldInfo& field) {
    return field.option == "--period";
  });
  ASSERT_NE(period, design.end());
  EXPECT_EQ(period->section, "controller");
  EXPECT_EQ(period->value, "TIME");
  EXPECT_EQ(period->example, "20ms");
  EXPECT_EQ(period->absent, "20 ms");  // ControllerOptions{}.period
}

TEST(Fields, AnalyzeOffersNoOptionThatChangesNothing) {
  for (const FieldInfo& field : fields_of(JobKind::analyze)) {
    EXPECT_TRUE(field.section == "mechanism" || field.section == "gains" ||
                field.section == "model" || field.section == "point" || field.option == "--period")
        << field.option;
    EXPECT_NE(field.option, "--angle-offset");
  }
}

TEST(Fields, EveryKindOfMechanismNeedsKeysThatThereAre) {
  for (const MechanismRow& row : mechanism_rows()) {
    for (const std::string_view key : row.needs) {
      const auto& fields = section_of("mechanism").fields;
      EXPECT_TRUE(std::any_of(fields.begin(), fields.end(), [&](const Field& field) {
        return field.key == key;
      })) << key;
    }
  }
}

std::string page(const std::string& name) {
  return read_file(FLYBALL_DOCS "/" + name, 1 << 20).value();
}

// If one of these fails, run scripts/write-docs.
TEST(Fields, TheDocsPageIsTheTable) {
  EXPECT_NE(page("project-file.md").find(project_markdown()), std::string::npos);
}
TEST(Fields, TheSchemaIsTheTable) {
  EXPECT_EQ(page("schemas/project.schema.json"), project_schema());
}

}  // namespace
}  // namespace flyball::study::fields_test
