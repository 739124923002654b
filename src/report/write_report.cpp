#include <flyball/report/write_report.hpp>

#include <utility>
#include <vector>

#include <flyball/io/output_folder.hpp>

#include "core/try.hpp"
#include "report/pictures.hpp"

namespace flyball::report {

Expected<WrittenReport> write_report(const Answer& answer, const std::string& folder,
                                     const Provenance& provenance) {
  FLYBALL_TRY(auto output, OutputFolder::create(folder));
  Provenance made{provenance.command, {}};
  const auto write = [&](const std::string& name, const std::string& contents) {
    made.files.push_back(name);
    return output.write(name, contents);
  };
  FLYBALL_CHECK(write("result.json", answer.json + "\n"));
  for (const AnswerFile& file : answer.files) {
    FLYBALL_CHECK(write(file.name, file.contents));
  }
  const std::vector<Picture> pictures = draw(answer.figures, true);
  WrittenReport report;
  for (const Picture& picture : pictures) {
    if (!picture.problem.empty()) {
      report.problems.push_back(picture.problem);
    }
    const std::string stem = "pictures/" + picture.figure.name;
    if (!picture.svg.empty()) {
      FLYBALL_CHECK(write(stem + ".svg", picture.svg));
    }
    if (!picture.png.empty()) {
      FLYBALL_CHECK(write(stem + ".png", picture.png));
    }
  }
  FLYBALL_CHECK(
      output.write("index.html", page_of(answer.document, pictures, answer.animations, made)));
  FLYBALL_CHECK(output.commit());
  return report;
}

}  // namespace flyball::report
