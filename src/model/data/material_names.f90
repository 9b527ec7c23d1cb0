! SPDX-License-Identifier: MIT
!> Numbers and names of block and joint materials, which groups of options change or add.
module rockdda_model_material_names
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : named_material_type
   use rockdda_model_regions, only : material_number, same_name
   implicit none
   private
   public :: most_number, described_materials, number_of_material, check_material_names

   !> Largest number of a material.
   integer, parameter :: most_number = 999

contains

   !> Which numbers of materials are described: the n of the analysis file, and those of groups.
   pure function described_materials(n, groups, labelled) result(described)
      integer, intent(in) :: n
      class(named_material_type), intent(in) :: groups(:)
      logical, intent(in) :: labelled            !! materials have any numbers, else one after another
      logical, allocatable :: described(:)
      integer :: i, last
      last = n
      do i = 1, size(groups)
         if (labelled .and. groups(i)%number <= most_number) last = max(last, groups(i)%number)
         if (groups(i)%number == last + 1) last = last + 1
      end do
      allocate (described(last))
      described = [(i <= n .or. .not. labelled, i=1, last)]
      do i = 1, size(groups)
         if (groups(i)%number >= 1 .and. groups(i)%number <= last) described(groups(i)%number) = .true.
      end do
   end function described_materials

   !> Number of the material that a word names: a number, or a name that a group gives; 0 if there is none.
   pure integer function number_of_material(word, groups) result(number)
      character(len=*), intent(in) :: word
      class(named_material_type), intent(in) :: groups(:)     !! of the options
      integer :: i
      number = material_number(trim(adjustl(word)))
      if (number > 0 .or. len_trim(word) == 0) return
      do i = 1, size(groups)
         if (.not. allocated(groups(i)%name)) cycle
         if (same_name(groups(i)%name, word)) number = groups(i)%number
      end do
   end function number_of_material

   !> Names are words that lists can hold, and no two materials have one name.
   subroutine check_material_names(kind, materials, messages)
      character(len=*), intent(in) :: kind       !! 'block', 'joint'
      class(named_material_type), intent(in) :: materials(:)
      type(diagnostics_type), intent(inout) :: messages
      integer :: i, k
      do i = 1, size(materials)
         if (.not. allocated(materials(i)%name)) cycle
         if (index(materials(i)%name, ',') > 0 .or. material_number(materials(i)%name) > 0) &
            call messages%add(severity%error, kind//' material '//to_string(i)//": a name has no comma and is no "// &
                              "number, found '"//materials(i)%name//"'", materials(i)%origin)
         do k = 1, i - 1
            if (.not. allocated(materials(k)%name)) cycle
            if (same_name(materials(i)%name, materials(k)%name)) call messages%add(severity%error, &
               kind//' materials '//to_string(k)//' and '//to_string(i)//" have one name, '"//materials(i)%name//"'", &
               materials(i)%origin)
         end do
      end do
   end subroutine check_material_names

end module rockdda_model_material_names
