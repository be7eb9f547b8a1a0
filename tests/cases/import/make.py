"""Writes the fixtures of this folder: the four-tank of the paper, as numpy and scipy save it. Needs both.

    python3 make.py
"""
import io
import struct
import zipfile
import zlib

import numpy as np
import scipy.io
import scipy.sparse

A = np.array([[0.9921, 0, 0, 0.0206], [0, 0.9835, 0, 0], [0, 0.0165, 0.9945, 0], [0, 0, 0, 0.9793]])
B = np.array([[0.0417, 2.47e-4], [0.0156, 0], [1.30e-4, 0.0311], [0, 0.0235]])
C = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0]])
STATES, INPUTS = ["h1", "h2", "h3", "h4"], ["v1", "v2"]


class FixedTime(zipfile.ZipFile):
    """An archive that is the same whenever it is written."""

    def add(self, name, array, method):
        data = io.BytesIO()
        np.save(data, array)
        info = zipfile.ZipInfo(name + ".npy", (1980, 1, 1, 0, 0, 0))
        info.compress_type = method
        self.writestr(info, data.getvalue())


def archive(path, method, **arrays):
    with FixedTime(path, "w") as zipped:
        for name, array in arrays.items():
            zipped.add(name, array, method)


def mat(path, variables, compressed=True, fmt="5"):
    scipy.io.savemat(path, variables, do_compression=compressed, format=fmt)
    if fmt == "5":
        with open(path, "r+b") as file:  # the header holds the time of day
            file.write(b"MATLAB 5.0 MAT-file, four-tank".ljust(116))


def csv(path, matrix, header=None, names=None, separator=",", decimal="."):
    number = lambda x: repr(float(x)).replace(".", decimal)
    with open(path, "w") as file:
        file.write("# four-tank\n")
        if header:
            file.write(separator.join(([""] if names else []) + header) + "\n")
        for k, row in enumerate(matrix):
            file.write(separator.join(([names[k]] if names else []) + [number(x) for x in row]) + "\n")


archive("stored.npz", zipfile.ZIP_STORED, A=A, B=B, C=C)
archive("deflated.npz", zipfile.ZIP_DEFLATED, A=np.asfortranarray(A), B=B.astype(">f8"), C=C.astype(np.int8))
np.save("A.npy", A)
np.save("B_fortran.npy", np.asfortranarray(B))
np.save("C_int.npy", C.astype(np.int32))
np.save("b_list.npy", B[:, 0])
np.save("complex.npy", A.astype(complex))
np.save("nan.npy", np.where(A == 0.0206, np.nan, A))
np.save("cube.npy", np.zeros((2, 2, 2)))
csv("A.csv", A)
csv("A_named.csv", A, STATES, STATES)
csv("B_header.csv", B, INPUTS, separator="\t")
csv("B_decimal_commas.csv", B, separator=";", decimal=",")
np.savetxt("C.txt", C)
np.savetxt("C_header.txt", C, header="written by savetxt")
with open("limits.csv", "w") as file:
    file.write("state, max, weight, start\n p, 10, 1, 0.5\n q, 20, 2, 0\n r, inf, 3, 0\n s, 40, 4, -0.5\n")
with open("ragged.csv", "w") as file:
    file.write("1.0,2.0\n3.0\n")
with open("words.csv", "w") as file:
    file.write("1.0,2.0\n3.0,O.5\n")
scipy.io.mmwrite("A_sparse.mtx", scipy.sparse.coo_matrix(A))
scipy.io.mmwrite("B_array.mtx", B)
scipy.io.mmwrite("symmetric.mtx", scipy.sparse.coo_matrix(np.array([[2.0, -1, 0], [-1, 2, 0], [0, 0, 3]])), symmetry="symmetric")
scipy.io.mmwrite("symmetric_array.mtx", np.array([[2.0, -1, 0], [-1, 2, 0], [0, 0, 3]]), symmetry="symmetric")
scipy.io.mmwrite("C_integer.mtx", C.astype(int))
with open("doubled.mtx", "w") as file:
    file.write("%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 0.5\n1 1 0.5\n")
plant = {"A": A, "B": B, "C": C, "note": "four-tank", "cells": np.array([1, "a"], dtype=object)}
mat("uncompressed.mat", plant, compressed=False)
mat("compressed.mat", plant)
mat("sparse.mat", {"A": scipy.sparse.csc_matrix(A), "B": B.astype(np.float32), "C": C.astype(np.int16)})
mat("structure.mat", {"sys": {"A": A, "B": B, "C": C}})
mat("complex.mat", {"A": A.astype(complex) * (1 + 1j)})
mat("version4.mat", {"A": A}, fmt="4")
with open("version73.mat", "wb") as file:  # what MATLAB's -v7.3 starts with
    file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + b"\x89HDF\r\n\x1a\n")


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)


# An object such as MATLAB's ss, as far as it has to be understood: flags, name, kind, class.
opaque = element(6, struct.pack("<II", 17, 0)) + element(1, b"sys") + element(1, b"MCOS") + element(1, b"ss")
with open("object.mat", "wb") as file:
    header = b"MATLAB 5.0 MAT-file, four-tank".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    packed = zlib.compress(element(14, opaque))
    file.write(header + struct.pack("<II", 15, len(packed)) + packed)

# The four-tank in continuous time about Johansson's minimum-phase operating point, tanks in the paper's order: time
# constants in s, pump gains in cm/s/V.
T1, T2, T3, T4 = 62.70338973387792, 29.992981153989742, 90.33529710787597, 23.890015378634814
Ac = np.array([[-1 / T1, 0, 0, 1 / T4], [0, -1 / T2, 0, 0], [0, 1 / T2, -1 / T3, 0], [0, 0, 0, -1 / T4]])
Bc = np.array([[0.7 * 3.35 / 28, 0], [0.3 * 3.35 / 32, 0], [0, 0.6 * 3.33 / 32], [0, 0.4 * 3.33 / 28]])
archive("four_tank_continuous.npz", zipfile.ZIP_DEFLATED, A=Ac, B=Bc, C=C, D=np.zeros((2, 2)))

# What the pages in docs/import have MATLAB and Julia write.
Ap = np.array([[-1 / 62.7, 0, 0, 1 / 23.9], [0, -1 / 30, 0, 0], [0, 1 / 30, -1 / 90.3, 0], [0, 0, 0, -1 / 23.9]])
Bp = np.array([[0.0838, 0], [0.0314, 0], [0, 0.0624], [0, 0.0476]])
mat("page.mat", {"A": Ap, "B": Bp, "C": C})
for name, matrix in (("A", Ap), ("B", Bp), ("C", C)):
    with open(f"page_{name}.csv", "w") as file:
        file.writelines(",".join(repr(float(x)) for x in row) + "\n" for row in matrix)
