! SPDX-License-Identifier: MIT
!> What a run is read from: its files, their texts, and what they say.
module rockdda_run_input
   use rockdda_model_analysis_input, only : analysis_input_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_model_options, only : run_options_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_cutting_cut, only : cut_report_type
   implicit none
   private
   public :: model_input_type, run_name, stem_of

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

end module rockdda_run_input
