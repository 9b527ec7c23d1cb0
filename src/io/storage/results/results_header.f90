! SPDX-License-Identifier: MIT
!> Header of a results file and its numbers of rows.
module rockdda_io_results_header
   use rockdda_base_kinds, only : wp, i8
   use rockdda_model_options, only : water_type
   implicit none
   private
   public :: results_header_type, results_rows_type, results_format_version, oldest_format_version, n_tables, n_totals

   !> Version that is written, and the oldest one that can be read: 1 has no stresses, opening and slip of contacts.
   integer, parameter :: results_format_version = 2, oldest_format_version = 1
   !> Growing tables, and checksums: one for each table, one for the model.
   integer, parameter :: n_tables = 54, n_totals = n_tables + 1

   !> Header: origin and options of the file.
   type :: results_header_type
      character(len=:), allocatable :: title
      character(len=4) :: units = 'none'                 !! system of units; not kept in checkpoints
      character(len=:), allocatable :: program_version
      character(len=:), allocatable :: created           !! UTC, as 2026-01-31T12:00:00Z
      character(len=:), allocatable :: geometry, analysis, config  !! the input files as read; '' without one
      character(len=:), allocatable :: stage_names(:)    !! for a new file; not kept in checkpoints
      integer, allocatable :: stage_resets(:)            !! 1: measured displacements count from the stage's start
      logical :: frames = .true.                         !! keep frames
      logical :: contacts = .true.                       !! keep the contacts of each frame
      logical :: single = .false.                        !! reals of frames, but places, have 32 bits
      integer :: n_frames_expected = 0                   !! of a new run; 0: not known
      real(wp) :: flush_interval = 2                     !! seconds between flushes
      integer :: n_boundaries = 0
      integer :: n_bolt_nodes = 0                        !! 0: only springs, or no bolts
      character(len=:), allocatable :: bolt_names(:)     !! where there are nodes; springs come first, with one each
      integer, allocatable :: bolt_first(:)              !! (bolts + 1) nodes before each
      real(wp), allocatable :: bolt_spacing(:)           !! (bolts) out of the plane [length]
      integer :: n_liner_nodes = 0                       !! 0: no linings
      character(len=:), allocatable :: liner_names(:)
      integer, allocatable :: liner_first(:)             !! (linings + 1) nodes before each
      real(wp), allocatable :: liner_section(:, :)       !! (5, linings) thickness, strengths, 1: closed, side
      integer, allocatable :: boundary_edges(:, :)       !! (2, n) boundary and first vertex of each edge, from 1
      character(len=10), allocatable :: boundary_kinds(:) !! (boundaries)
      type(water_type), allocatable :: water(:)          !! groups
      integer, allocatable :: water_edges(:, :)          !! (4, n) of stretches: group, vertices, joint beyond or 0
      real(wp), allocatable :: water_ends(:, :)          !! (2, n) their ends, shares of the edge
      character(len=80), allocatable :: stage_water(:)   !! groups that act in each stage; empty: all
   end type results_header_type

   !> Numbers of rows of a results file.
   type :: results_rows_type
      integer :: steps = 0             !! rows of history
      integer :: frames = 0
      integer :: contacts = 0          !! rows of the contacts of all frames
      integer(i8) :: totals(n_totals) = 0   !! checksums of the tables' rows; the last one of the model
   end type results_rows_type

end module rockdda_io_results_header
