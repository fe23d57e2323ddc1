// The similarity join as a textbook has it: every pair of scans, each a std::map from transmitter to strength.
//
//   textbook_join FILE THRESHOLD    prints the number of pairs and the processor seconds of the double loop
//
// FILE holds one reading per line, "scan transmitter strength"; scans are numbered from 0.

#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <map>
#include <string>
#include <vector>

using Scan = std::map<std::string, double>;

double cosine(const Scan& a, const Scan& b) {
    double product = 0, square_a = 0, square_b = 0;
    for (const auto& [transmitter, strength] : a) {
        square_a += strength * strength;
        const auto other = b.find(transmitter);
        if (other != b.end()) product += strength * other->second;
    }
    for (const auto& [transmitter, strength] : b) square_b += strength * strength;
    return product > 0 ? product / std::sqrt(square_a * square_b) : 0;
}

int main(int, char** arguments) {
    std::ifstream file(arguments[1]);
    const double threshold = std::atof(arguments[2]);
    std::vector<Scan> scans;
    std::size_t scan;
    std::string transmitter;
    double strength;
    while (file >> scan >> transmitter >> strength) {
        if (scan >= scans.size()) scans.resize(scan + 1);
        scans[scan][transmitter] = strength;
    }
    const std::clock_t start = std::clock();
    std::size_t pairs = 0;
    for (std::size_t i = 0; i < scans.size(); ++i)
        for (std::size_t j = i + 1; j < scans.size(); ++j) pairs += cosine(scans[i], scans[j]) >= threshold;
    const double seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
    std::cout << pairs << " " << seconds << "\n";
}
