#include <flyball/report/write_report.hpp>

#include <utility>
#include <vector>

#include <flyball/export/constants.hpp>
#include <flyball/export/generated_header.hpp>
#include <flyball/io/file.hpp>
#include <flyball/study/design_exports.hpp>
#include <flyball/study/project.hpp>
#include <flyball/study/schema.hpp>
#include <flyball/study/simulate_design.hpp>

#include "core/try.hpp"
#include "report/figures.hpp"
#include "report/files.hpp"
#include "report/render_html.hpp"

namespace flyball::report {

namespace {

void append(std::vector<ReportFile>& files, std::vector<ReportFile> more) {
  for (ReportFile& file : more) {
    files.push_back(std::move(file));
  }
}

Expected<void> add_design_files(std::vector<ReportFile>& files, const study::DesignResult& result,
                                const std::string& kA_reason) {
  const study::PlantDescription& plant = result.job.plant;
  const std::string name = exports::header_class_name(plant.kind);
  FLYBALL_TRY(auto header,
              exports::generate_header(study::controller_of(result), name, plant.unit));
  files.push_back({name + ".hpp", std::move(header)});
  for (const auto& paste : exports::paste_constants(study::constants_of(result, kA_reason))) {
    files.push_back({paste.file, paste.text});
  }
  append(files, data_files(result));
  return {};
}

/// Adds the pictures and the page, which links to everything, and writes all of it.
template <class Result>
Expected<void> write(const Result& result, std::vector<ReportFile> files, const std::string& folder,
                     Provenance provenance) {
  // Asked for first: drawing is wasted on a folder that cannot be written.
  FLYBALL_TRY(auto output, OutputFolder::create(folder));
  const std::vector<RenderedFigure> figures = render(figures_of(result), true);
  for (const RenderedFigure& figure : figures) {
    const std::string stem = "pictures/" + figure.figure.name;
    if (!figure.svg.empty()) {
      files.push_back({stem + ".svg", figure.svg});
    }
    if (!figure.png.empty()) {
      files.push_back({stem + ".png", figure.png});
    }
  }
  provenance.files.clear();
  for (const ReportFile& file : files) {
    provenance.files.push_back(file.name);
  }
  files.push_back({"index.html", page_of(result, figures, provenance)});
  for (const ReportFile& file : files) {
    FLYBALL_CHECK(output.write(file.name, file.contents));
  }
  return output.commit();
}

}  // namespace

Expected<void> write_identify_report(const study::IdentifyResult& result, const std::string& folder,
                                     const Provenance& provenance) {
  std::vector<ReportFile> files{{"result.json", study::to_json(result) + "\n"}};
  if (result.report.fit) {
    files.push_back({"gains.toml", study::gains_toml(result)});
  }
  append(files, data_files(result));
  return write(result, std::move(files), folder, provenance);
}

Expected<void> write_design_report(const study::DesignResult& result, const std::string& folder,
                                   const Provenance& provenance) {
  std::vector<ReportFile> files{{"result.json", study::to_json(result) + "\n"},
                                {"gains.toml", study::gains_toml(result, nullptr)}};
  FLYBALL_CHECK(add_design_files(files, result, ""));
  return write(result, std::move(files), folder, provenance);
}

Expected<void> write_tune_report(const study::TuneResult& result, const std::string& folder,
                                 const Provenance& provenance) {
  const study::IdentifyResult& identification = result.identification;
  std::vector<ReportFile> files{{"result.json", study::to_json(result) + "\n"}};
  const bool fitted = identification.report.fit.has_value();
  const bool designed = result.design && result.design->has_value();
  if (designed) {
    files.push_back(
        {"gains.toml",
         study::gains_toml(**result.design, fitted ? &*identification.report.fit : nullptr)});
    FLYBALL_CHECK(add_design_files(files, **result.design,
                                   fitted && !identification.report.fit->kA.determined
                                       ? identification.report.fit->kA.reason
                                       : ""));
  } else if (fitted) {
    files.push_back({"gains.toml", study::gains_toml(identification)});
  }
  append(files, data_files(identification));
  return write(result, std::move(files), folder, provenance);
}

Expected<void> write_analyze_report(const study::ModelAnalysis& result, const std::string& folder,
                                    const Provenance& provenance) {
  std::vector<ReportFile> files{{"result.json", study::to_json(result) + "\n"}};
  append(files, data_files(result));
  return write(result, std::move(files), folder, provenance);
}

}  // namespace flyball::report
