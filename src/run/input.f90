! SPDX-License-Identifier: MIT
!> What a run is read from: its files, their texts, and what they say.
!>
!> What the command line or the Python call requests of a run.
module rockdda_run_input
   use rockdda_model_analysis_input, only : analysis_input_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_model_options, only : run_options_type, unset_integer, unset_real, is_set, most_threads
   use rockdda_model_parameters, only : parameters_type
   use rockdda_cutting_cut, only : cut_report_type
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   implicit none
   private
   public :: model_input_type, run_name, stem_of, run_request_type, apply_request

   type :: model_input_type
      ! which files
      character(len=:), allocatable :: model_file      !! geometry or blocks
      character(len=:), allocatable :: analysis_file   !! '' when there is none, and so below
      character(len=:), allocatable :: config_file
      integer :: model_kind = 0                        !! file_kind%geometry or file_kind%blocks
      logical :: labelled = .false.                    !! the options file is a labelled file, which names the others
      logical :: in_memory = .false.                   !! the texts are given; file names are for messages only
      ! their content
      character(len=:), allocatable :: model_text, analysis_text, config_text
      type(geometry_input_type) :: geometry
      type(cut_report_type) :: cut
      type(block_system_type) :: blocks
      type(analysis_input_type) :: analysis
      type(run_options_type) :: options
      type(parameters_type) :: parameters
      logical :: has_blocks = .false.                  !! blocks are valid
   end type model_input_type

   !> Options of the command line or of the Python call; they override the options file.
   type :: run_request_type
      character(len=:), allocatable :: output        !! '' when not given, and so below
      character(len=:), allocatable :: config
      character(len=:), allocatable :: solver
      integer :: dialect = 0                         !! one of dialect%...
      integer :: threads = unset_integer
      integer :: steps = unset_integer
      integer :: save_every = unset_integer
      real(wp) :: t_end = unset_real
      real(wp) :: max_wall = unset_real
      real(wp) :: checkpoint_every = unset_real
      logical :: allow_open = .false.                !! an outline that does not close is a warning
      logical :: strict = .false.                    !! an answer that is not to be trusted ends the run
      logical :: force = .false.                     !! overwrite an older result
   end type run_request_type

contains

   !> Name of a run, from which those of its files are made: the stem of its labelled or analysis file.
   pure function run_name(input) result(name)
      type(model_input_type), intent(in) :: input
      character(len=:), allocatable :: name
      if (input%labelled) then
         name = stem_of(input%config_file)
      else
         name = stem_of(input%analysis_file)
      end if
   end function run_name

   !> File name without folders and without its last ending.
   pure function stem_of(path) result(stem)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: stem
      integer :: dot
      stem = path(index(path, '/', back=.true.) + 1:)
      dot = index(stem, '.', back=.true.)
      if (dot > 1) stem = stem(1:dot - 1)
   end function stem_of

   !> Override options of the file by those of the request.
   subroutine apply_request(request, options, messages)
      class(run_request_type), intent(in) :: request
      type(run_options_type), intent(inout) :: options
      type(diagnostics_type), intent(inout) :: messages
      if (is_set(request%threads)) options%threads = request%threads
      if (is_set(request%steps)) options%steps = request%steps
      if (is_set(request%t_end)) options%t_end = request%t_end
      if (is_set(request%max_wall)) options%max_wall = request%max_wall
      if (is_set(request%checkpoint_every)) options%checkpoint_every = request%checkpoint_every
      if (is_set(request%save_every)) then
         options%save_every = request%save_every
         options%save_dt = unset_real
      end if
      options%strict = options%strict .or. request%strict
      options%allow_open = options%allow_open .or. request%allow_open
      if (len(request%solver) > 0) options%method = request%solver
      if (len(request%output) > 0) options%output_file = request%output
      if (request%threads > most_threads) call messages%add(severity%error, 'threads: must be '// &
         to_string(most_threads)//' or less, found '//to_string(request%threads))
   end subroutine apply_request

end module rockdda_run_input
