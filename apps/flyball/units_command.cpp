#include <memory>

#include <flyball/study/units.hpp>

#include "answer.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

void add_units_command(CLI::App& program, Invocation& invocation) {
  struct Options {
    CommonOptions common;
    std::string dimension;
    bool markdown = false;
  };
  constexpr const char* schema = "flyball.units/1";
  CLI::App* command = program.add_subcommand("units", "List the units that quantities are read in");
  auto options = std::make_shared<Options>();
  command->add_option("DIMENSION", options->dimension, "One dimension, such as \"velocity\"");
  command->add_flag("--json", options->common.json, "Answer one JSON object on one line");
  command->add_flag("--markdown", options->markdown, "Print docs/units.md")->group("");
  command->callback([options, &invocation] {
    const auto run = [&]() -> int {
      if (options->markdown) {
        print(study::units_page());
        return success;
      }
      if (options->dimension.empty()) {
        return tell(study::units_answer(), options->common, false);
      }
      const auto dimension = study::find_dimension(options->dimension);
      return dimension ? tell(study::units_answer(*dimension), options->common, false)
                       : fail(dimension.error(), options->common, schema);
    };
    invocation.status = guarded(run, options->common, schema, "the units");
  });
}

}  // namespace flyball::app
