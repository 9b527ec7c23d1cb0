! SPDX-License-Identifier: MIT
!> Reader of run options: a namelist file with the groups and names of the table of options
!> (rockdda_model_option_table, docs/file-formats.md).
module rockdda_io_namelist_file
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity, at_word
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_material_names, only : number_of_material
   use rockdda_model_options, only : run_options_type
   use rockdda_io_namelist_parser, only : namelist_type, parse_namelist
   use rockdda_io_option_reader, only : read_options
   use rockdda_io_record_reader, only : append_in_order
   use rockdda_model_bolt_numbers, only : bolt_problem
   use rockdda_model_liner_options, only : liner_problem
   use rockdda_io_stage_check, only : check_stages, check_base_stage
   use rockdda_io_source, only : source_type, read_source
   use rockdda_base_suggest, only : did_you_mean
   implicit none
   private
   public :: read_options_file, read_options_source, list_given_options, given_group_type

   !> A group of a file as it stands there.
   type :: given_group_type
      character(len=:), allocatable :: name
      character(len=:), allocatable :: entries   !! names, ', ' between them
   end type given_group_type

contains

   !> Read and check a file of run options; every problem is added to `messages`.
   subroutine read_options_file(path, options, messages)
      character(len=*), intent(in) :: path
      type(run_options_type), intent(out) :: options
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      logical :: ok
      call read_source(path, source, messages, ok)
      if (ok) call read_options_source(source, options, messages)
   end subroutine read_options_file

   !> Read text in memory as read_options_file reads a file; paths in it are relative to the folder of `source%file`.
   subroutine read_options_source(source, options, messages)
      type(source_type), intent(in) :: source
      type(run_options_type), intent(out) :: options
      type(diagnostics_type), intent(inout) :: messages
      type(namelist_type), target :: namelist
      type(diagnostics_type) :: found
      character(len=:), allocatable :: problem
      integer :: i
      call parse_namelist(source, namelist, found)
      call read_options(namelist, options, found)
      options%labelled = any([(namelist%groups(i)%name == 'model', i=1, namelist%n)])
      do i = namelist%n, 1, -1
         if (namelist%groups(i)%name == 'model') options%model_origin = namelist%origin(namelist%groups(i)%place)
      end do
      do i = 1, size(options%joint_laws)
         if (.not. allocated(options%joint_laws(i)%word)) cycle
         options%joint_laws(i)%number = number_of_material(options%joint_laws(i)%word, options%joint_materials)
         if (options%joint_laws(i)%number == 0) call found%add(severity%error, &
            "&joint_law: there is no joint material '"//options%joint_laws(i)%word//"'"// &
            did_you_mean(options%joint_laws(i)%word, joint_names(options%joint_materials)), &
            at_word(options%joint_laws(i)%origin, options%joint_laws(i)%word))
      end do
      do i = 1, size(options%bolts)
         problem = bolt_problem(options%bolts(i))
         if (len(problem) > 0) call found%add(severity%error, '&bolt: '//problem, options%bolts(i)%origin)
      end do
      do i = 1, size(options%liners)
         problem = liner_problem(options%liners(i))
         ! what was given, but could not be read, is not missing
         if (found%has_error_about(problem(:max(0, index(problem, ' ') - 1)), options%liners(i)%origin)) cycle
         if (len(problem) > 0) call found%add(severity%error, '&liner: '//problem, options%liners(i)%origin)
      end do
      call check_stages(options%stages, options%changes, found)
      call check_base_stage(options%stages, options%base, found)
      call append_in_order(messages, found)
   end subroutine read_options_source

   !> Names of joint materials.
   pure function joint_names(materials) result(names)
      type(joint_material_type), intent(in) :: materials(:)
      character(len=80) :: names(size(materials))
      integer :: i
      names = ''
      do i = 1, size(materials)
         if (allocated(materials(i)%name)) names(i) = adjustl(materials(i)%name)
      end do
   end function joint_names

   !> List the groups of a file with the names in them, none when it cannot be read.
   subroutine list_given_options(path, groups)
      character(len=*), intent(in) :: path
      type(given_group_type), allocatable, intent(out) :: groups(:)
      type(namelist_type) :: namelist
      type(source_type) :: source
      type(diagnostics_type) :: ignored
      integer :: i, k
      logical :: ok
      call read_source(path, source, ignored, ok)
      if (ok) call parse_namelist(source, namelist, ignored)
      allocate (groups(namelist%n))
      do i = 1, namelist%n
         associate (given => namelist%groups(i))
            groups(i)%name = given%name
            groups(i)%entries = ''
            do k = 1, given%n
               if (k > 1) groups(i)%entries = groups(i)%entries//', '
               groups(i)%entries = groups(i)%entries//given%entries(k)%name
            end do
         end associate
      end do
   end subroutine list_given_options

end module rockdda_io_namelist_file
